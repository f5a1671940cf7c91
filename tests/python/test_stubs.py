"""Methods that are made from the table of the language: what editors and help() see of them, and errors in the words
of Python."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest

from hpcdem.api import blocks, functions
from hpcdem.api.methods import Models, Row, bound
from hpcdem.api.particles import ParticleCommands
from hpcdem.commands import dem
from scripts.lib.pages import stubs
from tests.tables import each

MADE = [(f"{of.__name__}.{name}", value) for of in (blocks.BlockCommands, *blocks.GROUPS)
        for name, value in vars(of).items() if hasattr(value, "made_by")]  # fmt: skip


def test_the_stubs_are_those_of_today() -> None:
    for path, content in stubs.files().items():
        assert path.read_text() == content, f"{path} is older than the table: ./scripts/pages"


@each(("name", "method"), MADE)
def test_help_says_what_each_argument_is(name: str, method: Any) -> None:
    made, signature = method.made_by, inspect.signature(method)
    names = [*signature.parameters][1:]
    text = inspect.getdoc(method) or ""
    assert text and max(map(len, text.split("\n"))) <= 120
    if isinstance(made, Row):
        assert names == [one.name for one in made.arguments]
        assert re.findall(r"^(\w+) : ", text, re.MULTILINE) == names
    else:
        assert isinstance(made, Models) and names == ["name", "where", "properties"]
        assert all(f"{model.keyword.name} : " in text for model in made.row.models)


OF_FUNCTIONS = {name: value for name, value in vars(ParticleCommands).items() if hasattr(value, "made_by")}


@each("name", OF_FUNCTIONS)
def test_a_method_of_particles_has_the_arguments_of_its_function(name: str) -> None:
    """Which are read from its text, as a module must not be imported for them."""
    method = OF_FUNCTIONS[name]
    module, _, function = method.made_by.name.partition(".")
    real = inspect.signature(getattr(getattr(dem, module), function)).parameters
    names = {one: value for one, value in real.items() if one not in ("sim", "folder")}
    own = {one: value for one, value in inspect.signature(method).parameters.items() if one != "self"}
    assert own.keys() == names.keys() and inspect.getdoc(method)
    for one, parameter in own.items():
        if {parameter.default, names[one].default} != {None, inspect.Parameter.empty} and name != "join":
            assert parameter.default == names[one].default, one
        if one not in ("where", "color", "rad", "file", "dofs", "legend"):
            kind = names[one].annotation
            assert parameter.annotation in (kind, f"{kind} | None")
    assert not any(one in functions.TAKEN for one in own if one not in ("where", "color", "dofs", "num", "legend"))


class Python:
    """Methods whose signatures are Python's own affair."""

    def usual(self, first, second, third=None, *, word, other=0) -> None: ...

    def rest(self, first, *rest, word=None) -> None: ...

    def plain(self, first, second) -> None: ...


CALLS: list[tuple[tuple[int, ...], dict[str, int]]] = [
    ((), {}), ((1,), {}), ((1, 2), {}), ((1, 2), {"word": 3}), ((1, 2, 3, 4), {"word": 3}), ((1,), {"first": 2}),
    ((1, 2), {"word": 3, "what": 4}), ((1, 2, 3), {"third": 4, "word": 5}), ((1, 2), {"other": 5}), ((1, 2, 3), {}),
    ((1, 2, 3, 4, 5), {"word": 3, "other": 4}), ((), {"word": 1}),
]  # fmt: skip


@pytest.mark.parametrize("name", ["usual", "rest", "plain"])
def test_what_is_wrong_with_a_call_is_reported_in_the_words_of_python(name: str) -> None:
    method = getattr(Python(), name)
    signature = inspect.signature(method)
    for values, options in CALLS:
        wanted: Any = None
        try:
            method(*values, **options)
        except TypeError as error:
            wanted = str(error).removeprefix(f"Python.{name}() ")
        try:
            given: Any = bound(list(signature.parameters.values()), values, options)
        except TypeError as error:
            assert str(error) == wanted, (values, options)
        else:
            assert wanted is None, (values, options)
            told = signature.bind(*values, **options).arguments
            assert {key: value for key, value in given.items() if value != ()} == told

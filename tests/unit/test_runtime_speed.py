"""The rate of the last run: kept, found again, and never in the way."""

from __future__ import annotations

import os

import pytest

from hpcdem.runtime import speed


@pytest.fixture(autouse=True)
def base(tmp_path, monkeypatch):
    """A cache folder of our own; it does not exist yet."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    return folder


def test_nothing_is_known_at_first():
    assert speed.recall("hertz") == (speed.DEFAULT, False) == (10e6, False)


def test_each_kind_has_its_rate():
    speed.remember(11e6, "hertz")
    assert speed.recall("hertz") == speed.recall("linear") == (11e6, True), "better the other kind than none"
    speed.remember(20e6, "linear")
    speed.remember(12e6, "hertz")
    assert (speed.recall("hertz"), speed.recall("linear")) == ((12e6, True), (20e6, True))


def test_short_runs_are_not_kept():
    speed.remember_run(10**9, 4.0, 2, "hertz")
    speed.remember_run(0, 100.0, 2, "hertz")
    assert not speed.recall("hertz")[1]
    speed.remember_run(10**9, 50.0, 2, "hertz")
    assert speed.recall("hertz") == (10**7, True)


@pytest.mark.parametrize(
    "text", [b"", b"{", b"[1]", b"7", b'{"hertz": "fast"}', b'{"hertz": -1}', b'{"hertz": 1e999}', b"\xff"]
)
def test_a_spoilt_file_is_as_good_as_none(base, text):
    base.mkdir()
    (base / "speed.json").write_bytes(text)
    assert speed.recall("hertz") == (speed.DEFAULT, False)
    speed.remember(3e6, "hertz")
    assert speed.recall("hertz") == (3e6, True)


@pytest.mark.parametrize(
    ("rate", "kind"), [(float("nan"), "hertz"), (0.0, "hertz"), (float("inf"), "linear"), (1e6, "odd")]
)
def test_what_is_no_rate_is_not_kept(base, rate, kind):
    speed.remember(rate, kind)
    assert not base.exists()


def test_a_folder_that_cannot_be_written_is_no_matter(base):
    base.write_text("a file")
    speed.remember(1e6, "hertz")
    assert not speed.recall("hertz")[1]


def test_nothing_is_left_of_a_write_that_fails(base, monkeypatch):
    def full(*_):
        raise OSError(28, "no space")

    monkeypatch.setattr(os, "replace", full)
    speed.remember(1e6, "hertz")
    assert list(base.iterdir()) == []

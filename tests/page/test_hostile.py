"""The page against what nobody should send: slow and many connections, and random requests for everything it answers.

All on 127.0.0.1, in this process, with the numbers and times that stand here.
"""

from __future__ import annotations

import json
import random
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from hpcdem.page import limits
from hpcdem.page import server as module
from hpcdem.page.desk import Desk
from hpcdem.page.server import Answer, PageServer, as_json
from hpcdem.page.sources import Sources
from hpcdem.page.viewer import Viewer
from tests.conftest import PATIENCE
from tests.page.test_server import ask
from tests.tables import each
from tests.view import frames

QUICK = 5.0
"""Seconds in which a page must answer whatever else goes on."""


@contextmanager
def served(calls: dict[str, Any], **more: Any) -> Iterator[PageServer]:
    page = PageServer({"": Answer(b"<p>page", "text/html")}, calls, **more)
    thread = threading.Thread(target=page.serve_forever, args=[0.02])
    thread.start()
    try:
        yield page
    finally:
        page.shutdown()
        thread.join()
        page.server_close()


def connected(page: PageServer, content: bytes = b"") -> socket.socket:
    line = socket.create_connection(("127.0.0.1", page.server_port), timeout=PATIENCE)
    line.sendall(content)
    return line


# -- connections ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("begun", [b"", b"GET /wr", b"POST /"])
def test_slow_connections_without_the_key_keep_nobody_out(begun):
    """Three times as many as can stand at the door: the page answers at once, again and again."""
    with served({"echo": as_json}) as page:
        lines = [connected(page, begun) for _ in range(3 * module.DOOR)]
        for _ in range(5):
            began = time.monotonic()
            assert ask(page, "GET", f"/{page.key}/")[0] == 200
            assert ask(page, "POST", f"/{page.key}/echo", b'{"a": 1}')[0] == 200
            assert time.monotonic() - began < QUICK
            lines += [connected(page, begun) for _ in range(10)]
        assert len(page.door) <= module.DOOR
        for line in lines:
            line.close()


def test_the_eldest_at_the_door_goes_and_nobody_inside(monkeypatch):
    monkeypatch.setattr(module, "DOOR", 4)
    with served({"echo": as_json}) as page:
        slow = connected(page, f"POST /{page.key}/echo HTTP/1.0\r\nHost: localhost\r\n".encode())
        while not page.free._value < module.CONVERSATIONS:  # its first line has been read
            time.sleep(0.001)
        lines = [connected(page, b"GET /") for _ in range(5)]
        assert lines[0].recv(1) == b""
        slow.sendall(b"Content-Type: application/json\r\nContent-Length: 8\r\n\r\n" + b'{"a": 1}')
        assert b'{"a": 1}' in b"".join(iter(lambda: slow.recv(4096), b""))
        for line in (*lines, slow):
            line.close()


def trickle(line: socket.socket, content: bytes, pause: float) -> None:
    """A byte now and then, until the other end has had enough."""
    try:
        for byte in content:
            line.sendall(bytes([byte]))
            time.sleep(pause)
    except OSError:
        pass


def test_who_trickles_is_ended_by_the_deadline_of_the_whole(monkeypatch):
    """Each byte comes soon after the one before; all of them would take minutes."""
    monkeypatch.setattr(module, "HEAD_SECONDS", 0.3)
    monkeypatch.setattr(module, "BODY_SECONDS", 0.3)
    with served({"echo": as_json}) as page:
        head = f"POST /{page.key}/echo HTTP/1.0\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        began = time.monotonic()
        slow_head, slow_body = (
            connected(page, head.encode()),
            connected(page, f"{head}Content-Length: 900\r\n\r\n".encode()),
        )
        writers = [
            threading.Thread(target=trickle, args=[slow_head, b"X-Header: " + b"x" * 900, 0.05]),
            threading.Thread(target=trickle, args=[slow_body, b" " * 900, 0.05]),
        ]
        for writer in writers:
            writer.start()
        assert slow_head.recv(4096) == b""
        assert b" 408 " in slow_body.recv(4096)
        assert time.monotonic() - began < QUICK
        for line in (slow_head, slow_body):
            line.close()
        for writer in writers:
            writer.join()
        assert page.free._value == module.CONVERSATIONS


def test_without_the_key_nothing_is_read_or_computed():
    """The answer comes after the first line: no header, no body is waited for."""
    seen: list[dict] = []
    with served({"echo": lambda wanted: seen.append(wanted) or as_json(wanted)}) as page:
        line = connected(page, b"POST /wrong/echo HTTP/1.0\r\n")
        assert b" 403 " in line.recv(4096)
        line.close()
    assert seen == []


def test_more_requests_with_the_key_than_can_be_are_reported_so(monkeypatch):
    monkeypatch.setattr(module, "CONVERSATIONS", 2)
    with served({"echo": as_json}) as page:
        slow = [connected(page, f"GET /{page.key}/ HTTP/1.0\r\n".encode()) for _ in range(2)]
        while page.free._value:
            time.sleep(0.001)
        status, _, body = ask(page, "GET", f"/{page.key}/")
        assert status == 503 and "try again in a moment" in json.loads(body)["error"]
        for line in slow:
            line.close()


def test_endless_headers_are_not_read():
    with served({"echo": as_json}) as page:
        line = connected(page, f"GET /{page.key}/ HTTP/1.0\r\nHost: localhost\r\n".encode())
        try:
            for _ in range(200):
                line.sendall(b"X: " + b"x" * 4000 + b"\r\n")
        except OSError:
            pass  # it did not read them, which is what is wanted
        line.close()
        assert ask(page, "GET", f"/{page.key}/")[0] == 200


# -- requests ------------------------------------------------------------------------------------------------------


class Noted:
    """In the place of the console's process."""

    language = "pcdc"

    def __init__(self) -> None:
        self.said: list[tuple[str, str, str]] = []

    def carry_out(self, text: str, language: str, name: str = "") -> None:
        self.said.append((text, language, name))

    def start(self, language: str) -> None:
        from hpcdem.core.errors import HpcdemError

        if language not in ("pcdc", "zdem"):
            raise HpcdemError("language: expected pcdc or zdem")

    def interrupt(self) -> None:
        pass

    def output_since(self, number: Any) -> dict[str, Any]:
        return {"lines": [], "last": 0}


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimpleNamespace]:
    """A page with frames of blocks, of discs and in space, a history, and scripts."""
    folder, scripts = tmp_path_factory.mktemp("run"), tmp_path_factory.mktemp("scripts")
    frames.write_blocks(folder, 7)
    frames.write_blocks(folder, 9, grown=0.2)
    frames.write_discs(folder)
    frames.write_body(folder, broken=True, wet=True)
    (folder / "history_load.csv").write_text("step,time [s],reaction_y [N/m]\n1,0.1,2\n2,0.2,nan\n")
    (scripts / "a.sc").write_text("pcdc model new\n")
    viewer, desk = Viewer(Sources([folder], empty=True)), Desk(scripts, folder)
    desk.console = Noted()  # type: ignore[assignment]
    with served(viewer.calls() | desk.calls(), kinds=limits.KINDS) as page:
        objects = [list(viewer.sources.moment(s.frames[0])[1].objects) for s in viewer.sources.found]
        yield SimpleNamespace(page=page, folder=folder, scripts=scripts, viewer=viewer, objects=objects,
                              formats=["csv", "dxf", "mv"])  # fmt: skip


def asked(hostile: SimpleNamespace, name: str, content: Any) -> tuple[int, Any]:
    """Status and answer, JSON where it is. It comes within PATIENCE, or that is an error."""
    began = time.monotonic()
    body = content if isinstance(content, bytes) else json.dumps(content).encode()
    status, headers, answer = ask(hostile.page, "POST", f"/{hostile.page.key}/{name}", body)
    assert time.monotonic() - began < 4 * QUICK, (name, content)
    return status, json.loads(answer) if headers["Content-Type"].startswith("application/json") else answer


LAYER = {"object": "elements", "field": "stress_yy"}
VIEW = {"layers": [LAYER, {"object": "joints"}], "title": "step {step}"}
PICTURE = {"source": 0, "frame": -1, "view": VIEW, "width": 40, "height": 30, "fine": False, "dark": False}


@each(
    ("name", "content", "status", "words"),
    [
        ("tell", {"what": ["stop"]}, 400, "what: expected text, read a list"),
        ("tell", {"what": {"a": 1}}, 400, "what: expected text, read names and values"),
        ("curves", {"chart": ["a"]}, 400, "chart: expected text, read a list"),
        ("curves", {"x": "time", "y": "load"}, 400, "y: expected a list, read text"),
        ("curves", {"x": "time", "y": [["load"]]}, 422, "a chart needs an x and a list of y"),
        ("rename", {"name": "a.sc", "to": 7}, 400, "to: expected text, read a whole number"),
        ("about", {"source": "0"}, 400, "source: expected a whole number, read text"),
        ("about", {"source": True}, 400, "source: expected a whole number, read true or false"),
        ("picture", PICTURE | {"view": [1]}, 400, "view: expected names and values, read a list"),
        ("picture", PICTURE | {"width": 40.5}, 400, "width: expected a whole number, read a number"),
        ("picture", PICTURE | {"width": 65535}, 422, "from 1 to 4096, read 65535"),
        ("picture", PICTURE | {"width": 4096, "height": 4096}, 422, "4096 x 4096 pixels; a picture has at most"),
        ("file", PICTURE | {"format": ["png"]}, 400, "format: expected text, read a list"),
        ("file", PICTURE | {"format": "gif", "fps": [1]}, 400, "fps: expected a number, read a list"),
        ("file", PICTURE | {"format": "bmp"}, 422, "format: expected one of png"),
        ("picture", b'{"source": NaN}', 400, "NaN: expected finite numbers"),
        ("picture", b'{"source": 1e999}', 400, "1e999: expected finite numbers"),
        ("picture", b'{"source": ' + b"9" * 40 + b"}", 400, "at most 18 digits"),
        ("view", b'{"view": {"title": "\\ud800"}}', 400, "expected text of whole characters"),
        ("view", b'{"view": ' + b"[" * 60 + b"]" * 60 + b"}", 400, "more than 20 nested lists and objects"),
        ("view", {"view": {"layers": [LAYER | {"name": f"l{k}"} for k in range(300)]}}, 422, "layers: 300, at most 60"),
        ("picture", PICTURE | {"view": {"layers": [LAYER | {"name": f"l{k}"} for k in range(300)]}}, 422, "at most 60"),
    ],
)  # fmt: skip
def test_what_nobody_should_send_is_refused_in_words(hostile, name, content, status, words):
    found, answer = asked(hostile, name, content)
    assert (found, words in answer["error"]) == (status, True), answer


def test_as_many_layers_as_a_view_may_have_are_drawn(hostile):
    layers = [LAYER | {"name": f"l{k}"} for k in range(60)]
    source = [s.name for s in hostile.viewer.sources.found].index(f"{hostile.folder.name}: rock")
    assert asked(hostile, "picture", PICTURE | {"source": source, "view": {"layers": layers}})[0] == 200


WEIRD: list[Any] = [
    None, True, False, 0, 1, -1, 2, 7, 10**17, -(10**17), 0.5, -0.0, 1e300, -1e300, 1e-300, "", " ", "x", "a.sc", "\0",
    "../a.sc", "粒径", "x" * 3000, "{step}", "{0.__class__}", "{step:>99999999}",
    "$\\frac$", "\n", [], [[]], [1, 2], ["stop"],
    {}, {"a": 1}, {"view": 1}, "range x 0 1",
    "range group", "1/0 > x", "x > 1 and", "hypot(x,x)<1", "-" * 300 + "x > 1",
    "elements", "particles", "joints", "stress_yy", "displacement", "viridis", "#ffffff", "iso", "x=1", "x<0.5", "+z",
    "0,0,0", "1e999,0,1", "png", "svg", "pdf", "csv", "dxf", "html", "mv",
    "pcdc", "zdem", "pcdc ele", "BOX lef", "stop",
    "load", ["load"], ["load", 1], 30 * ["load"], "a [m] = 1",
    [0, 1, 0, 1], [0, 1e-300, 0, 1], [-1e308, 1e308, -1e308, 1e308], [0, 1e-9, 0, 1e9],
    [1e17, 1e17 + 100, 0, 1], ["0", "1", "0", "1"], [LAYER], [LAYER, LAYER], [{"object": "liners", "size": 100.0}],
]  # fmt: skip
LOOKS = {
    "object": "elements", "name": "a", "visible": True, "field": "stress_yy", "limits": [0.0, 1.0], "log": True,
    "colours": "viridis", "colour": "#00ff00", "opacity": 0.5, "edges": True, "size": 2.0, "vectors": "displacement",
    "arrows": 2.0, "filter": "x > 1",
}  # fmt: skip
SEEN = {
    "camera": [0.0, 1.0, 0.0, 1.0], "eye": "iso", "section": "x=1", "deformed": 10.0, "title": "{time}", "axes": False,
    "legend": False, "step": 7,
}  # fmt: skip
CALLS: dict[str, dict[str, Any]] = {
    "state": {}, "about": {"source": 0, "frame": -1}, "fields": {"source": 0, "frame": -1, "object": "elements"},
    "picture": PICTURE, "pick": PICTURE | {"column": 3, "row": 3},
    "curves": {"x": "time", "y": ["load", "2 * 'load'"], "format": "csv"},
    "presets": {}, "whole": {"text": "for k in x:", "language": "pcdc"},
    "rename": {"name": "b.sc", "to": "c.sc", "stamp": "1 2"},
    "tell": {"what": "save"}, "view": {"view": VIEW},
    "file": PICTURE | {"format": "csv", "label": "elements", "fps": 10},
    "console": {"since": 0}, "say": {"text": "model new", "name": "", "language": "pcdc"}, "interrupt": {},
    "restart": {"language": "pcdc"}, "complete": {"line": "pcdc ele", "language": "pcdc"},
    "check": {"text": "pcdc model new\n", "name": "a.sc"}, "scripts": {}, "read": {"name": "a.sc"},
    "write": {"name": "b.sc", "text": "pcdc model new\n", "stamp": None},
}  # fmt: skip


def weird_request(rng: random.Random, name: str, hostile: SimpleNamespace) -> dict[str, Any]:
    """A request that is right but for one value, mostly."""
    wanted: dict[str, Any] = json.loads(json.dumps(CALLS[name]))
    places: list[tuple[dict, Any]] = [(wanted, word) for word in (*wanted, "more")]
    if "source" in wanted:
        wanted["source"] = source = rng.randrange(len(hostile.objects))
        objects = hostile.objects[source]
    if "object" in wanted:
        wanted["object"] = rng.choice(objects)
    if "view" in wanted:
        objects = objects if "source" in wanted else ["elements", "joints"]
        layers = [{"object": rng.choice(objects), "name": f"l{k}"} for k in range(rng.randrange(1, 4))]
        for layer in layers:
            layer |= {word: LOOKS[word] for word in rng.sample(sorted(LOOKS), rng.randrange(3))}
        view = wanted["view"] = {"layers": layers} | {word: SEEN[word] for word in rng.sample(sorted(SEEN), 2)}
        places = 2 * places + 2 * [(view, word) for word in SEEN] + 2 * [(layers[0], word) for word in LOOKS]
        places += [(view, "layers"), (wanted, "view"), (view, "more"), (layers[0], "object")]
    if "width" in wanted:
        wanted["width"], wanted["height"] = rng.choice((1, 2, 40, 300)), rng.choice((1, 40, 200))
    if "format" in wanted and name == "file":
        wanted["format"] = rng.choice(hostile.formats)
    for _ in range(rng.choice((0, 1, 1, 1, 2))):
        table, word = rng.choice(places)
        if rng.random() < 0.1:
            table.pop(word, None)
        else:
            table[word] = rng.choice(WEIRD)
    return wanted


def fuzz(hostile: SimpleNamespace, seed: int, count: int) -> dict[int, int]:
    """Ask at random; how often each status came."""
    rng, statuses = random.Random(seed), dict.fromkeys((200, 400, 422), 0)
    for _ in range(count):
        name = rng.choice(sorted(CALLS))
        wanted = weird_request(rng, name, hostile)
        status, answer = asked(hostile, name, wanted)
        about = (seed, name, wanted, answer)
        assert status in statuses, about
        statuses[status] += 1
        if status != 200:
            said = answer["error"]
            assert said and not any(word in said for word in ("Input should", "Error:", "object at 0x", "loc=")), about
    assert {path.suffix for path in hostile.scripts.iterdir()} == {".sc"}
    return statuses


def test_random_requests_are_answered_or_refused(hostile):
    assert min(fuzz(hostile, 1, 500).values()) > 50


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_many_random_requests_are_answered_or_refused(hostile, seed, monkeypatch):
    """Also for files that matplotlib draws, half a second each."""
    monkeypatch.setattr(hostile, "formats", ["csv", "dxf", "mv", "png", "svg", "pdf", "html", "gif"])
    fuzz(hostile, seed, 500)


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b"null", b'"a"', b"{}{}", b'{"a":1,}', b"\xff\xfe", b"[" * 100000])
def test_bodies_that_are_no_objects(hostile, body):
    for name in ("state", "picture", "say", "write"):
        status, answer = asked(hostile, name, body)
        assert status == 400 and answer["error"] == "expected a JSON object", (name, answer)


# -- a large picture ------------------------------------------------------------------------------------------------


def test_others_are_answered_while_a_picture_is_made(hostile, monkeypatch):
    """Whatever needs no picture; those who ask for pictures wait, and too many are told to come back."""
    from hpcdem.post.view import screen

    going, wait = threading.Event(), threading.Event()
    paint = screen.paint

    def slow(*arguments: Any) -> Any:
        going.set()
        assert wait.wait(PATIENCE)
        return paint(*arguments)

    monkeypatch.setattr(screen, "paint", slow)
    statuses: list[int] = []
    threads = [
        threading.Thread(target=lambda k=k: statuses.append(asked(hostile, "picture", PICTURE | {"width": 50 + k})[0]))
        for k in range(limits.PICTURES + 4)
    ]
    for thread in threads:
        thread.start()
    try:
        assert going.wait(PATIENCE)
        began = time.monotonic()
        for name in ("state", "curves", "view", "console", "interrupt", "complete", "scripts"):
            assert asked(hostile, name, CALLS[name])[0] == 200, name
        assert time.monotonic() - began < QUICK
    finally:
        wait.set()
        for thread in threads:
            thread.join()
    assert sorted(set(statuses)) == [200, 503] and statuses.count(503) == 4

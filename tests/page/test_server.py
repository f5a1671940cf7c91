"""Who may ask the server of the page, for what, and how much of it is read."""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Iterator

import pytest

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.page import server as module
from hpcdem.page.server import Answer, PageServer, as_json
from tests.conftest import PATIENCE


def refused(_: dict) -> Answer:
    raise HpcdemError("table:2: not like this")


def broken(_: dict) -> Answer:
    raise KeyError("ours")


@pytest.fixture
def server() -> Iterator[PageServer]:
    page = PageServer(
        {"": Answer(b"<p>page", "text/html"), "page.css": Answer(b"p{}", "text/css")},
        {"echo": as_json, "refused": refused, "broken": broken},
    )
    thread = threading.Thread(target=page.serve_forever, args=[0.02])
    thread.start()
    yield page
    page.shutdown()
    thread.join()
    page.server_close()


def ask(server: PageServer, method: str, path: str, body: bytes | None = None, **headers: str):
    """Status, headers and body; the header names are written with underscores."""
    line = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=PATIENCE)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    line.request(method, path, body, {"Content-Type": "application/json", **named} if method == "POST" else named)
    answer = line.getresponse()
    content = answer.read()
    line.close()
    return answer.status, answer.headers, content


def test_page_and_its_parts_are_there_under_the_key(server):
    assert server.url == f"http://127.0.0.1:{server.server_port}/{server.key}/"
    for name, content in (("", b"<p>page"), ("page.css", b"p{}")):
        status, headers, body = ask(server, "GET", f"/{server.key}/{name}")
        assert (status, body) == (200, content)
        assert headers["Cache-Control"] == "no-store"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert "unsafe" not in headers["Content-Security-Policy"]
        assert "Python" not in headers["Server"]


def test_two_servers_have_different_keys(server):
    other = PageServer({}, {})
    assert len(server.key) >= 20 and other.key != server.key
    other.server_close()


def test_it_listens_on_the_loopback_address_only(server):
    assert server.socket.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize(
    "path", ["/", "/page.css", "/wrong/", "/wrong/page.css", "//", "/\xe9/", "*", "/open/", "/open/x"]
)
def test_without_the_key_there_is_nothing(server, path):
    line = socket.create_connection(("127.0.0.1", server.server_port), timeout=PATIENCE)
    line.sendall(f"GET {path} HTTP/1.0\r\nHost: localhost\r\n\r\n".encode("latin-1"))
    answer = b"".join(iter(lambda: line.recv(4096), b""))
    line.close()
    assert b" 403 " in answer.split(b"\r\n")[0] and b"page" not in answer.split(b"\r\n\r\n")[1]
    assert server.key.encode() not in answer


@pytest.mark.parametrize(
    "name", ["../pyproject.toml", "%2e%2e/x", "/etc/passwd", "page.css/", "static/page.css", "x\x00"]
)
def test_names_are_looked_up_in_a_table_never_on_the_disk(server, name):
    line = socket.create_connection(("127.0.0.1", server.server_port), timeout=PATIENCE)
    line.sendall(f"GET /{server.key}/{name} HTTP/1.0\r\nHost: localhost\r\n\r\n".encode())
    answer = b"".join(iter(lambda: line.recv(4096), b""))
    line.close()
    assert b" 404 " in answer.split(b"\r\n")[0]


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "localhost:4000", "[::1]:80", "LOCALHOST"])
def test_names_of_this_machine_are_answered(server, host):
    assert ask(server, "GET", f"/{server.key}/", Host=host)[0] == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80", "", "[", "10.0.0.1"]
)
def test_a_name_that_was_bent_to_this_machine_is_refused(server, host):
    """DNS rebinding: the page of another site has its own name resolve to 127.0.0.1 and asks there."""
    status, _, body = ask(server, "GET", f"/{server.key}/", Host=host)
    assert status == 403 and "localhost only" in json.loads(body)["error"]
    assert ask(server, "POST", f"/{server.key}/echo", b"{}", Host=host)[0] == 403


def test_a_request_without_or_with_two_hosts_is_refused(server):
    for hosts in ("", "Host: localhost\r\nHost: evil.example\r\n"):
        line = socket.create_connection(("127.0.0.1", server.server_port), timeout=PATIENCE)
        line.sendall(f"GET /{server.key}/ HTTP/1.0\r\n{hosts}\r\n".encode())
        assert b" 403 " in line.recv(4096)
        line.close()


def test_a_ticket_opens_the_page_once(server):
    path = server.ticket().removeprefix(f"http://127.0.0.1:{server.server_port}")
    assert server.key not in path
    status, headers, _ = ask(server, "GET", path)
    assert status == 303 and headers["Location"] == f"/{server.key}/"
    assert ask(server, "GET", path)[0] == 403


def test_calls_take_an_object_and_give_one(server):
    status, headers, body = ask(server, "POST", f"/{server.key}/echo", '{"粒径": [1, 2]}'.encode())
    assert status == 200 and json.loads(body) == {"粒径": [1, 2]}
    assert headers["Content-Type"].startswith("application/json")


def test_what_the_user_can_change_comes_as_a_sentence(server):
    status, _, body = ask(server, "POST", f"/{server.key}/refused", b"{}")
    assert status == 422 and json.loads(body) == {"error": "table:2: not like this"}


def test_an_error_of_ours_is_reported_and_the_server_continues(server):
    status, _, body = ask(server, "POST", f"/{server.key}/broken", b"{}")
    assert status == 500 and "KeyError" in json.loads(body)["error"]
    assert ask(server, "POST", f"/{server.key}/echo", b"{}")[0] == 200


@pytest.mark.parametrize("body", [b"", b"[]", b"1", b"{", b"\xff", b"[" * 20000, b'{"a": ' * 9000])
def test_what_is_no_object_is_refused(server, body):
    assert ask(server, "POST", f"/{server.key}/echo", body)[0] == 400


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Content_Type": "text/plain"}, 415),
        ({"Content_Type": "application/x-www-form-urlencoded"}, 415),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Content_Length": str(module.LARGEST_REQUEST + 1)}, 413),
        ({"Content_Length": "9" * 30}, 413),
        ({"Content_Length": "-1"}, 411),
        ({"Content_Length": "2_0"}, 411),
        ({"Content_Length": "²"}, 411),
    ],
)
def test_requests_of_other_sites_and_sizes_are_refused(server, headers, status):
    try:
        encoded = {name: value.encode("utf-8") for name, value in headers.items()}
        assert ask(server, "POST", f"/{server.key}/echo", b"{}", **encoded)[0] == status
    except (ConnectionResetError, BrokenPipeError):  # it did not read the body, which is what is wanted
        assert status == 413


def test_the_page_itself_may_ask(server):
    origin = f"http://127.0.0.1:{server.server_port}"
    assert ask(server, "POST", f"/{server.key}/echo", b"{}", Origin=origin)[0] == 200


def test_other_methods_are_not_there(server):
    for method in ("PUT", "DELETE", "OPTIONS", "HEAD", "TRACE"):
        assert ask(server, method, f"/{server.key}/")[0] == 501


def test_a_port_in_use_is_a_clear_error(server):
    with pytest.raises(UsageError, match=rf"--port {server.server_port}: cannot listen: Address already in use"):
        PageServer({}, {}, server.server_port)


def test_who_sends_nothing_is_not_waited_for(server, monkeypatch):
    monkeypatch.setattr(module, "BODY_SECONDS", 0.2)
    line = socket.create_connection(("127.0.0.1", server.server_port), timeout=PATIENCE)
    line.sendall(f"POST /{server.key}/echo HTTP/1.0\r\nHost: localhost\r\nContent-Type: application/json\r\n".encode())
    line.sendall(b"Content-Length: 10\r\n\r\n{")
    assert b" 408 " in line.recv(4096)
    line.close()

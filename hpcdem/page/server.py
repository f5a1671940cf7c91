"""The HTTP side of the page: who may ask, for what, and how much of it is read.

The server listens on 127.0.0.1 only. Other people on the machine do not know the key that is part of every address;
pages of other sites do not know it either, and a name of theirs that resolves to 127.0.0.1 (DNS rebinding) is refused
by the header Host. What can be asked for are the entries of two tables made before the first request: texts, and
functions of a JSON object. Nothing in a request becomes the name of a file.
"""

from __future__ import annotations

import json
import secrets
import socketserver
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

from hpcdem.core.errors import HpcdemError, UsageError

LOOPBACK = "127.0.0.1"
NAMES = frozenset((LOOPBACK, "localhost", "::1"))
"""Host names of an address that a browser on this machine, or at the other end of `ssh -L`, opens."""
LARGEST_REQUEST = 1024 * 1024
"""Bytes of a request's body: a script of the editor, at most."""
CONVERSATIONS = 32
"""Requests at a time; a browser makes six."""
PATIENCE = 20.0
"""Seconds for which the server waits for the next byte of a request."""
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # the address holds the key
    "X-Content-Type-Options": "nosniff",
}


@dataclass(frozen=True)
class Answer:
    """What the browser gets. kind: media type; location: where the
    browser shall go instead."""

    body: bytes
    kind: str = "application/json; charset=utf-8"
    status: int = HTTPStatus.OK
    location: str = ""


def as_json(content: Any, status: int = HTTPStatus.OK) -> Answer:
    """An object as an answer."""
    return Answer(json.dumps(content, ensure_ascii=False, allow_nan=False).encode(), status=status)


Call = Callable[[dict[str, Any]], Answer]


class PageServer(ThreadingHTTPServer):
    """texts: what GET answers, by the last part of the address ("" is the page); calls: the same of POST, functions of
    the JSON object in the body that may raise HpcdemError (with a `status` of HTTP if it is not 422). port 0: a free
    one."""

    daemon_threads = True
    request_queue_size = CONVERSATIONS

    def __init__(self, texts: Mapping[str, Answer], calls: Mapping[str, Call], port: int = 0) -> None:
        self.texts, self.calls, self.key = texts, calls, secrets.token_urlsafe(18)
        self.tickets: set[str] = set()
        self.free = threading.BoundedSemaphore(CONVERSATIONS)
        try:
            super().__init__((LOOPBACK, port), Conversation)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise UsageError(
                f"--port {port}: cannot listen there: {reason}; without --port a free one is taken"
            ) from None

    def server_bind(self) -> None:
        """As TCPServer does it: HTTPServer would ask the name service for the name of 127.0.0.1."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = LOOPBACK, self.server_address[1]

    @property
    def url(self) -> str:
        """The address to open, key included."""
        return f"http://{LOOPBACK}:{self.server_port}/{self.key}/"

    def ticket(self) -> str:
        """An address that leads to the page once: other people can see with what words a browser is started."""
        ticket = secrets.token_urlsafe(18)
        self.tickets.add(ticket)
        return f"http://{LOOPBACK}:{self.server_port}/open/{ticket}"

    def process_request(self, request: Any, client_address: Any) -> None:
        """In a thread, if one is free; else the connection is closed."""
        if self.free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """The thread of one connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that went away, or was too slow, is no error; others are answered by Conversation."""


class _Refused(Exception):
    """A request that is not carried out; status: of HTTP."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status, self.why = status, why


class Conversation(BaseHTTPRequestHandler):
    """One request and its answer (HTTP/1.0: the connection ends with it)."""

    server: PageServer
    timeout = PATIENCE
    server_version, sys_version = "hpcdem", ""

    def do_GET(self) -> None:
        """The page and what belongs to it."""
        self._answer(self._judged(self._text))

    def do_POST(self) -> None:
        """A specimen, a file."""
        self._answer(self._judged(self._called))

    def _judged(self, work: Callable[[], Answer]) -> Answer:
        try:
            return work()
        except _Refused as refused:
            return as_json({"error": refused.why}, refused.status)
        except HpcdemError as error:
            return as_json({"error": str(error)}, getattr(error, "status", HTTPStatus.UNPROCESSABLE_ENTITY))
        except OSError:  # the browser went away, or was too slow
            raise
        except Exception as error:  # an error of ours must reach the person before the page, not end a thread
            return as_json({"error": f"{type(error).__name__}: {error}"}, HTTPStatus.INTERNAL_SERVER_ERROR)

    def _text(self) -> Answer:
        self._local()
        if self.path.startswith("/open/"):
            ticket = self.path.removeprefix("/open/")
            if ticket in self.server.tickets:
                self.server.tickets.remove(ticket)
                return Answer(b"", "text/plain", HTTPStatus.SEE_OTHER, f"/{self.server.key}/")
        name = self._permitted()
        if name not in self.server.texts:
            raise _Refused(HTTPStatus.NOT_FOUND, "there is nothing of this name")
        return self.server.texts[name]

    def _called(self) -> Answer:
        self._local()
        origin = self.headers.get("Origin", f"http://{self.headers['Host']}")
        if origin != f"http://{self.headers['Host']}":
            raise _Refused(HTTPStatus.FORBIDDEN, "this server answers its own page only")
        name = self._permitted()
        if name not in self.server.calls:
            raise _Refused(HTTPStatus.NOT_FOUND, "there is nothing of this name")
        return self.server.calls[name](self._content())

    def _local(self) -> None:
        """Refuse what was sent to a name that is not this machine's own."""
        hosts = self.headers.get_all("Host") or []
        if len(hosts) != 1 or _name(hosts[0]) not in NAMES:
            raise _Refused(HTTPStatus.FORBIDDEN, "this server answers to 127.0.0.1 and localhost only")

    def _permitted(self) -> str:
        """Last part of the address, if who asks knows the key."""
        key, _, name = self.path.partition("?")[0].removeprefix("/").partition("/")
        if not secrets.compare_digest(key.encode(), self.server.key.encode()):
            raise _Refused(HTTPStatus.FORBIDDEN, "open the address that hpcdem printed: its key is missing here")
        return name

    def _content(self) -> dict[str, Any]:
        """The JSON object of the body."""
        if self.headers.get_content_type() != "application/json":  # what a form of another site cannot send
            raise _Refused(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "expected application/json")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise _Refused(HTTPStatus.LENGTH_REQUIRED, "expected a Content-Length")
        if len(length) > 9 or int(length) > LARGEST_REQUEST:
            raise _Refused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"more than {LARGEST_REQUEST} bytes")
        try:
            content = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            content = None
        if not isinstance(content, dict):
            raise _Refused(HTTPStatus.BAD_REQUEST, "expected a JSON object")
        return content

    def _answer(self, answer: Answer) -> None:
        self.send_response(answer.status)
        for name, value in HEADERS.items():
            self.send_header(name, value)
        if answer.location:
            self.send_header("Location", answer.location)
        self.send_header("Content-Type", answer.kind)
        self.send_header("Content-Length", str(len(answer.body)))
        self.end_headers()
        self.wfile.write(answer.body)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: requests hold the key."""


def _name(host: str) -> str | None:
    """The name in a header Host, without the port."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None

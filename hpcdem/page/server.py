"""The HTTP side of the page: who may ask, for what, and how much of it is read.

The server listens on 127.0.0.1 only. Other people on the machine do not know the key that is part of every address;
pages of other sites do not know it either, and a name of theirs that resolves to 127.0.0.1 (DNS rebinding) is refused
by the header Host. Requests can name only entries of two tables made before the first request: texts, and
functions of a JSON object. Nothing in a request becomes the name of a file.

A connection stands at the door until its first line has shown the key: nothing else of it is read before, it has a
deadline, and where many stand there the one that came first goes for each that comes. So nobody without the key can
keep the page from those who have it.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import secrets
import socket
import socketserver
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

from hpcdem.core import validation
from hpcdem.core.errors import HpcdemError, UsageError

LOOPBACK = "127.0.0.1"
NAMES = frozenset((LOOPBACK, "localhost", "::1"))
"""Host names of an address that a browser on this machine, or at the other end of `ssh -L`, opens."""
LARGEST_REQUEST = 1024 * 1024
"""Largest body of a request [bytes]: a script of the editor."""
LARGEST_HEAD = 64 * 1024
"""Largest size of the first line and the headers [bytes]; the rest is not read."""
DEEPEST = 20
"""Largest number of nested lists and objects in a body."""
CONVERSATIONS = 32
"""Largest number of simultaneous requests with the key; a browser makes six."""
DOOR = 64
"""Largest number of connections that have not sent the key yet."""
HEAD_SECONDS = 10.0
"""Time from the connection to the end of the headers [s]."""
BODY_SECONDS = 20.0
"""Time from there to the end of the body [s]."""
SLOWEST = 50e3
"""Smallest rate at which an answer must be received [bytes/s], after the first seconds (as many as for a body)."""
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
    """Answer to one request. kind: media type; location: address to which the browser is redirected."""

    body: bytes
    kind: str = "application/json; charset=utf-8"
    status: int = HTTPStatus.OK
    location: str = ""


def as_json(content: Any, status: int = HTTPStatus.OK) -> Answer:
    """An object as an answer."""
    return Answer(json.dumps(content, ensure_ascii=False, allow_nan=False).encode(), status=status)


Call = Callable[[dict[str, Any]], Answer]


class BusyError(HpcdemError):
    """Too many requests at a time; they can be repeated a moment later."""

    status = HTTPStatus.SERVICE_UNAVAILABLE


class PageServer(ThreadingHTTPServer):
    """texts: what GET answers, by the last part of the address ("" is the page); calls: the same of POST, functions of
    the JSON object in the body that may raise HpcdemError (with a `status` of HTTP if it is not 422); kinds: of values
    in it, by their names (see limits.KINDS). port 0: a free one."""

    daemon_threads = True
    request_queue_size = DOOR

    def __init__(
        self, texts: Mapping[str, Answer], calls: Mapping[str, Call], port: int = 0,
        kinds: Mapping[str, tuple[type, ...]] | None = None,
    ) -> None:  # fmt: skip
        self.texts, self.calls, self.key, self.kinds = texts, calls, secrets.token_urlsafe(18), kinds or {}
        self.tickets: set[str] = set()
        self.door: dict[socket.socket, None] = {}
        """Connections that have not shown the key, in the order in which they came."""
        self.turn = threading.Lock()
        self.free = threading.BoundedSemaphore(CONVERSATIONS)
        try:
            super().__init__((LOOPBACK, port), Conversation)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise UsageError(f"--port {port}: cannot listen: {reason}. Without --port a free port is used") from None

    def server_bind(self) -> None:
        """Bind like TCPServer: HTTPServer would query the name service for the name of 127.0.0.1."""
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
        """Process a request in a thread. If too many clients wait for admission, the one that has waited longest is
        dropped."""
        with self.turn:
            self.door[request] = None
            eldest = next(iter(self.door)) if len(self.door) > DOOR else None
            if eldest is not None:
                del self.door[eldest]
        if eldest is not None:
            with contextlib.suppress(OSError):
                eldest.shutdown(socket.SHUT_RDWR)  # its thread reads the end, and closes it
        super().process_request(request, client_address)

    def admitted(self, request: socket.socket) -> bool:
        """Admit a client that has shown the key; False if the maximum number of conversations is active. `free` is
        released at the end."""
        with self.turn:
            self.door.pop(request, None)
        return self.free.acquire(blocking=False)

    def shutdown_request(self, request: Any) -> None:
        """The end of a connection."""
        with self.turn:
            self.door.pop(request, None)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that went away, or was too slow, is no error; others are answered by Conversation."""


class _Refused(Exception):
    """A rejected request; status: of HTTP."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status, self.why = status, why


class _Incoming(io.RawIOBase):
    """Stream of at most `count` bytes from a client. It ends after them, and raises TimeoutError after the deadline."""

    def __init__(self, connection: socket.socket, seconds: float, count: int) -> None:
        super().__init__()
        self.connection = connection
        self.allow(seconds, count)

    def allow(self, seconds: float, count: int) -> None:
        """Allow `count` more bytes within the next `seconds`."""
        self.until, self.left = time.monotonic() + seconds, count

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Bytes that are there; 0 at the end."""
        rest = self.until - time.monotonic()
        if rest <= 0.0:
            raise TimeoutError
        self.connection.settimeout(rest)
        count = self.connection.recv_into(memoryview(buffer)[: self.left]) if self.left else 0
        self.left -= count
        return count


class Conversation(BaseHTTPRequestHandler):
    """One request and its answer (HTTP/1.0: the connection ends with it)."""

    server: PageServer
    server_version, sys_version = "hpcdem", ""
    inside = False
    raw_requestline: bytes

    def setup(self) -> None:
        """Read with a deadline for all of a request, where the usual file has one for each piece."""
        super().setup()
        self.rfile.close()
        self.incoming = _Incoming(self.connection, HEAD_SECONDS, LARGEST_HEAD)
        self.rfile = io.BufferedReader(self.incoming)

    def handle(self) -> None:
        """Handle one request."""
        try:
            super().handle()
        finally:
            if self.inside:
                self.server.free.release()

    def parse_request(self) -> bool:
        """Look for the key before anything else is read."""
        words = self.raw_requestline.decode("latin-1").split()
        path = words[1] if len(words) > 1 else ""
        if not (self._knows(path) or path.removeprefix("/open/") in self.server.tickets):
            why, status = "open the address that hpcdem printed: its key is missing here", HTTPStatus.FORBIDDEN
        elif not self.server.admitted(self.request):
            why, status = "too many requests at a time; try again in a moment", HTTPStatus.SERVICE_UNAVAILABLE
        else:
            self.inside = True
            return super().parse_request()
        self.command, self.requestline, self.request_version = "", "", "HTTP/1.0"
        self._answer(as_json({"error": why}, status))
        return False

    def _knows(self, path: str) -> bool:
        """Return whether an address begins with the key."""
        key = path.partition("?")[0].removeprefix("/").partition("/")[0]
        return secrets.compare_digest(key.encode(), self.server.key.encode())

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
            raise _Refused(HTTPStatus.NOT_FOUND, "unknown name")
        return self.server.texts[name]

    def _called(self) -> Answer:
        self._local()
        origin = self.headers.get("Origin", f"http://{self.headers['Host']}")
        if origin != f"http://{self.headers['Host']}":
            raise _Refused(HTTPStatus.FORBIDDEN, "this server accepts requests of its own page only")
        name = self._permitted()
        if name not in self.server.calls:
            raise _Refused(HTTPStatus.NOT_FOUND, "unknown name")
        return self.server.calls[name](self._content())

    def _local(self) -> None:
        """Refuse what was sent to a name that is not this machine's own."""
        hosts = self.headers.get_all("Host") or []
        if len(hosts) != 1 or _name(hosts[0]) not in NAMES:
            raise _Refused(HTTPStatus.FORBIDDEN, "this server accepts the addresses 127.0.0.1 and localhost only")

    def _permitted(self) -> str:
        """Last part of the address, after the key."""
        if not self._knows(self.path):
            raise _Refused(HTTPStatus.FORBIDDEN, "open the address that hpcdem printed: its key is missing here")
        return self.path.partition("?")[0].removeprefix("/").partition("/")[2]

    def _content(self) -> dict[str, Any]:
        """The JSON object of the body."""
        if self.headers.get_content_type() != "application/json":  # what a form of another site cannot send
            raise _Refused(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "expected application/json")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise _Refused(HTTPStatus.LENGTH_REQUIRED, "expected a Content-Length")
        if len(length) > 9 or int(length) > LARGEST_REQUEST:
            raise _Refused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"more than {LARGEST_REQUEST} bytes")
        self.incoming.allow(BODY_SECONDS, int(length))
        try:
            text = self.rfile.read(int(length))
        except TimeoutError:
            raise _Refused(
                HTTPStatus.REQUEST_TIMEOUT, f"the request did not arrive within {BODY_SECONDS:g} s"
            ) from None
        content = _read(text)
        for name, kinds in self.server.kinds.items():
            value = content.get(name)
            if value is not None and type(value) not in kinds:
                expected = validation.kind_of(kinds[0]())
                why = f"{name}: expected {expected}, read {validation.kind_of(value)}"
                raise _Refused(HTTPStatus.BAD_REQUEST, why)
        return content

    def _answer(self, answer: Answer) -> None:
        self.send_response(answer.status)
        for name, value in HEADERS.items():
            self.send_header(name, value)
        if answer.location:
            self.send_header("Location", answer.location)
        self.send_header("Content-Type", answer.kind)
        self.send_header("Content-Length", str(len(answer.body)))
        self.connection.settimeout(BODY_SECONDS + len(answer.body) / SLOWEST)  # for all of it
        self.end_headers()
        self.wfile.write(answer.body)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: requests contain the key."""


def _read(text: bytes) -> dict[str, Any]:
    """The JSON object in a body, with numbers and texts that can be answered as JSON."""
    try:
        content = json.loads(text, parse_int=_whole, parse_float=_finite, parse_constant=_finite)
        _check_depth(content)
    except (ValueError, RecursionError) as problem:
        message = str(problem) if isinstance(problem, _UnfitError) else ""
        raise _Refused(HTTPStatus.BAD_REQUEST, message or "expected a JSON object") from None
    if not isinstance(content, dict):
        raise _Refused(HTTPStatus.BAD_REQUEST, "expected a JSON object")
    return content


class _UnfitError(ValueError):
    """A value that no request has."""


def _whole(text: str) -> int:
    if len(text.lstrip("-")) > 18:
        raise _UnfitError(f"{text[:20]}...: expected whole numbers of at most 18 digits")
    return int(text)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise _UnfitError(f"{text[:20]}: expected finite numbers")
    return value


def _check_depth(content: Any) -> None:
    """Refuse what lies too deep, and halves of characters (surrogates), which no file can hold."""
    level = [content]
    for _ in range(DEEPEST):
        texts = [value for value in level if isinstance(value, str)]
        texts += [name for value in level if isinstance(value, dict) for name in value]
        try:
            "".join(texts).encode()
        except UnicodeEncodeError:
            raise _UnfitError("expected text of whole characters") from None
        level = [
            inner for value in level if isinstance(value, (dict, list))
            for inner in (value.values() if isinstance(value, dict) else value)
        ]  # fmt: skip
        if not level:
            return
    raise _UnfitError(f"more than {DEEPEST} nested lists and objects")


def _name(host: str) -> str | None:
    """The name in a header Host, without the port."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None

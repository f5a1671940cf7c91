"""The page as a program: its address, the browser it opens, its end."""

from __future__ import annotations

import os
import re
import signal
import socket
import stat
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.page import lifetime, viewer
from hpcdem.page.limits import LIMITS
from hpcdem.page.maker import request_of, values_of
from hpcdem.pre.specimen import Request
from tests.conftest import PATIENCE, popen
from tests.page.conftest import command_line


def get(url: str) -> bytes:
    with urllib.request.urlopen(url, timeout=PATIENCE) as answer:
        return answer.read()


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_the_page_and_all_it_has_started(serve_page, grading_file, how):
    served = serve_page(grading_file)
    assert b"<title>" in get(served.url)
    makers = served.makers
    assert makers
    served.process.send_signal(how)
    out, err = served.process.communicate(timeout=PATIENCE)
    assert served.process.returncode == 0 and err == ""
    assert out.splitlines()[-1] == "Page closed."
    assert not any(map(alive, makers))


def test_ctrl_c_in_the_midst_of_work_ends_it_too(serve_page, grading_file):
    served = serve_page(grading_file, number=20_000, roundness=0.0, void_ratio=0.1)
    asking = subprocess.Popen(
        [sys.executable, "-c", f"import urllib.request as u, json; v = json.load(u.urlopen('{served.url}start'));"
         f"r = u.Request('{served.url}specimen', json.dumps(v['request']).encode(), {{'Content-Type': "
         "'application/json'}); print('asked', flush=True); u.urlopen(r)"],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert asking.stdout is not None and asking.stdout.readline() == "asked\n"
    makers = served.makers
    served.process.send_signal(signal.SIGINT)
    served.process.communicate(timeout=PATIENCE)
    assert served.process.returncode == 0 and not any(map(alive, makers))
    assert asking.wait(PATIENCE) != 0


def test_the_makers_end_when_the_server_is_killed(serve_page, grading_file, wait_until):
    served = serve_page(grading_file)
    makers = served.makers
    served.process.kill()
    wait_until(lambda: not any(map(alive, makers)), "the end of the makers")


def test_a_port_can_be_chosen_and_one_in_use_is_refused(serve_page, grading_file):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        words = [sys.executable, *command_line(grading_file), "--serve", "--no-browser", "--port", str(port)]
        process = popen(words)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 2
        assert f"--port {port}: cannot listen" in err and "Traceback" not in err
    assert f":{port}/" in serve_page(grading_file, "--port", str(port)).url


def test_the_browser_is_opened_at_an_address_that_works_once(
    serve_page, grading_file, tmp_path, wait_until, monkeypatch
):
    """Others can see with what words a program was started, so these must not hold the key."""
    note, program = tmp_path / "note", tmp_path / "browser"
    program.write_text(f'#!/bin/sh\nprintf "%s" "$*" >{note}.tmp && mv {note}.tmp {note}\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("BROWSER", str(program))
    monkeypatch.setenv("DISPLAY", ":99")
    served = serve_page(grading_file, browser_opens=True)
    wait_until(note.exists, "the browser")
    ticket = note.read_text()
    key = served.url.split("/")[3]
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/open/[\w-]+", ticket) and key not in ticket
    assert get(ticket) == get(served.url)
    with pytest.raises(urllib.error.HTTPError, match="403"):
        get(ticket)


def test_without_a_window_no_browser_is_opened(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert not lifetime.can_open()
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    assert lifetime.can_open()


def test_the_page_begins_with_the_request_of_the_command_line(wanted):
    request = request_of(wanted(shape="ellipse", size_rule="area", mass_exponent=3, cell=1.5))
    assert (request.size_rule, request.mass_exponent, request.cell) == ("area", 3, 1.5)
    assert request_of(values_of(request)) == request


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"number": None, "width": 0.02}, "give --number"),
        ({"number": LIMITS["number"][1] + 1}, "number: read 20001, expected a whole number from 10 to 20000"),
        ({"void_ratio": 50.0}, "void_ratio: read 50"),
    ],
)
def test_what_the_page_cannot_show_is_refused_at_once(values, message):
    request = Request(sizes=(2.0, 1.0), percents=(100.0, 50.0), **values)
    with pytest.raises(HpcdemError, match=message):
        lifetime.serve(request, browser=False)


def test_all_files_of_the_pages_are_there_and_served():
    folder = lifetime.resources.files("hpcdem.page") / "static"
    assert {file.name for file in folder.iterdir()} == {*lifetime.KINDS, *viewer.KINDS}
    for first, kinds in (("index.html", lifetime.KINDS), ("viewer.html", viewer.KINDS)):
        texts = [(folder / name).read_text(encoding="utf-8") for name in kinds if name.endswith((".js", ".html"))]
        assert (folder / first).read_text(encoding="utf-8") in texts
        for name in re.findall(r'(?:(?:src|href)=|from )"(?:\./)?([\w.]+)"', "".join(texts)):
            assert name in kinds, name


def test_a_port_out_of_range_is_a_clear_error():
    with pytest.raises(UsageError, match="--port 70000: cannot listen"):
        lifetime.PageServer({}, {}, 70000)

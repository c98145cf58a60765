"""The page on which a class looks on: read-only, of any size and patience, beside the daemon."""

import json
import re
import socket
import subprocess
import time
from contextlib import ExitStack, suppress
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest

from rig.board.page import BoardPage
from rig.daemon.client import Client, Line
from rig.ready import ready_protocol
from rig.results.live import LiveAnalysis
from rig.tui.motion import motions
from rig.tui.scale import drawing
from tests.cli.lab import command
from tests.tui.lab import kept_session
from tests.waiting import PATIENCE_S, until

CLIENTS = 400
TOO_MUCH = b"GET / HTTP/1.1\r\nX-Junk: " + b"a" * 10**6


@pytest.fixture(scope="module")
def daemon(tmp_path_factory):
    """Yield a daemon's process, its socket and the port of its page."""
    path = tmp_path_factory.mktemp("board") / "rig.sock"
    process = subprocess.Popen(
        command("daemon", "--port", "sim://", "--socket", path, "--board", ":0"),
        stderr=subprocess.PIPE,
        text=True,
    )
    lines = [process.stderr.readline() for _ in range(2)]
    assert "on this computer only" in lines[1], lines
    address = urlsplit(lines[1].split()[-1])
    assert address.hostname == "localhost"
    yield process, path, address.port
    process.kill()
    process.communicate()
    until(lambda: not answers(address.port), lambda: "the page outlives its daemon")


def answers(port):
    """Whether anybody listens."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def ask(port, method="GET", target="/", **headers):
    """Ask the page's server once."""
    connection = HTTPConnection("localhost", port, timeout=PATIENCE_S)
    try:
        connection.request(method, target, headers=headers)
        answer = connection.getresponse()
        return answer, answer.read()
    finally:
        connection.close()


def tag_of(daemon):
    """Return what tells the page from others."""
    return ask(daemon[2])[0].getheader("ETag")


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "HEAD", "OPTIONS", "get", "TRACE"])
def test_nothing_but_reading_is_answered(daemon, method):
    answer, _ = ask(daemon[2], method)
    assert (answer.status, answer.getheader("Allow")) == (405, "GET")


def test_a_page_is_sent_once_and_needs_nothing_else(daemon):
    answer, page = ask(daemon[2])
    assert answer.status == 200
    policy = answer.getheader("Content-Security-Policy")
    assert "default-src 'none'" in policy
    assert "unsafe-eval" not in policy
    assert not re.search(rb"""(src|href)=["'](?!data:)|url\(|@import""", page)
    # A daemon may show another page meanwhile.
    until(lambda: ask(daemon[2], **{"If-None-Match": tag_of(daemon)})[0].status == 304, str)
    assert ask(daemon[2], target="/../etc/passwd")[0].status == 404


def test_whatever_clients_do_stop_and_page_are_there(daemon):
    process, path, port = daemon
    with ExitStack() as stack:
        for number in range(CLIENTS):
            line = stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))
            line.sendall(b"GET / HT" if number % 2 else b"")
        long = stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))
        with suppress(OSError):  # it hangs up on what has no end
            long.sendall(TOO_MUCH)
        client = Client(Line(path, "a test"))
        client.stop("a test")
        client.close()
        assert ask(port)[0].status == 200
    with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as raw:
        raw.sendall(b"\0\xff / nonsense\r\n\r\n")
        assert raw.recv(100).startswith(b"HTTP/1.1 400 ")
    assert process.poll() is None


def test_a_session_is_shown_however_short_it_was(daemon, tmp_path):
    client = Client(Line(daemon[1], "a test"))
    client.take_control()
    client.open_session(str(ready_protocol("falling-ball")), str(tmp_path / "a.session"))
    time.sleep(0.6)  # in which the daemon tells the page, which need not have looked
    client.close_session()
    client.close()
    until(lambda: b"A ball past four gates" in ask(daemon[2])[1])


def test_a_place_that_is_taken_is_refused(daemon, call):
    place = f":{daemon[2]}"
    assert "--board" in call("daemon", "--port", "sim://", "--board", place, code=2).err


def test_a_session_is_shown_in_words_and_pictures_until_another_is_open(tmp_path):
    recorded, page = kept_session(tmp_path), BoardPage("http://192.0.2.7:8080/")
    assert "No session is open" in page.look({})
    news = {"session": str(recorded), "drop": None}
    assert "is being read" in page.look(news)
    text = page.look(news)
    assert page.look(news) is None, "nothing has changed"
    assert re.search(r"Run 4 of 4 · \d+° · chain \w strikes", text)
    assert re.search(r"\w wins by \d+\.\d+ ± \d\.\d+ cm; model ", text)
    assert "SIMULATED DATA" in text
    assert 'aria-label="QR code of http://192.0.2.7:8080/"' in text
    picture = json.loads(re.search("data-picture='(.*?)'", text)[1])
    assert [name[1:] for _, name in picture["names"]] == [" strikes", " falls freely"]
    view = LiveAnalysis(recorded).read()
    job = view.jobs[-1]
    drop = view.drops[job], view.scales[job].hz, view.results[job]
    run = view.plan[job.run]
    moved = drawing(view.protocol, run, motions(view.protocol, run, drop), (), 1.0)
    assert picture["apart_cm"][-1] == round(1e2 * moved.apart_m, 1), "the terminal has another Δz"
    armed = page.look(news | {"drop": {"run": 2, "attempt": 1, "state": "armed"}})
    assert re.search(r"Run 2 of 4 .* is armed", armed)
    assert "Run 4 of 4" in page.look({"session": None, "drop": None}), "it stays when it is closed"


def test_a_page_of_this_computer_alone_says_so_in_place_of_a_code():
    text = BoardPage("http://localhost:8080/").look({})
    assert "Only this computer sees this page" in text
    assert "QR code" not in text


def test_a_session_that_cannot_be_read_is_said(tmp_path):
    broken = tmp_path / "b.session"
    broken.write_bytes(b"no session")
    page = BoardPage("http://localhost:8080/")
    page.look({"session": str(broken)})
    assert "The session cannot be read" in page.look({"session": str(broken)})

"""A whole session by keys alone in a real terminal."""

import asyncio
import os
import re
import shutil
import signal
import sys
import time
from contextlib import suppress
from unittest.mock import Mock

import pytest
from textual.drivers.linux_driver import LinuxDriver

from rig.errors import RigError
from rig.tui import terminal as keyboard
from rig.tui.stillness import STILL_S
from tests.cli.lab import ROOT, assert_whole, short
from tests.programs import run_program
from tests.waiting import until

_NEEDS_TMUX = pytest.mark.skipif(
    shutil.which("tmux") is None and not os.environ.get("CI"), reason="tmux is not installed"
)


class Terminal:
    """One tmux server with one window."""

    def __init__(self, folder):
        self.folder = folder
        self.socket = folder / "tmux"

    def tmux(self, *arguments):
        return run_program("tmux", "-S", self.socket, "-f", "/dev/null", *arguments).stdout

    def begins(self, url):
        """Open a new session of two runs and come to the first; return its file."""
        protocol, session = self.folder / "keys.yaml", self.folder / "keys.session"
        protocol.write_text(short("[40 deg]", 2), "utf-8")
        self.tmux(
            "new-session", "-d", "-x", "100", "-y", "30", "-c", str(ROOT),
            sys.executable, "-m", "rig", "tui", str(protocol), "--port", url, "--session",
            str(session), "--socket", str(self.folder / "rig.sock"),
        )  # fmt: skip
        self.sees("HOME", "Enter open", "SIMULATED")
        self.press("Enter")
        self.sees("DEVICE", "Enter to the first run", "clear")
        self.press("Enter")
        return session

    def screen(self):
        return re.sub(r"\s+", " ", self.tmux("capture-pane", "-p"))

    def press(self, *keys):
        self.tmux("send-keys", *keys)

    def enters(self, text):
        """Press Enter by itself where a text stands, until it is gone, or the program is."""

        def gone():
            time.sleep(1.2 * STILL_S)
            try:
                if text not in self.screen():
                    return True
                self.press("Enter")
            except AssertionError:  # the program, and tmux with it
                return True
            return False

        until(gone)

    def drops(self, number):
        """Arm until chains fall: on a busy machine a board that is not heard of disarms itself."""

        def fell():
            screen = self.screen()
            if "nothing fell" in screen and "Enter arm" in screen:
                self.enters("Enter arm")
            return all(text in screen for text in (f"Run {number} of 2", " wins by "))

        self.enters("Enter arm")
        until(fell, lambda: self.tmux("capture-pane", "-p"))

    def sees(self, *texts):
        until(
            lambda: all(text in self.screen() for text in texts),
            lambda: f"no {texts}:\n{self.tmux('capture-pane', '-p')}",
        )


@pytest.fixture
def terminal(folder):
    found = Terminal(folder)
    yield found
    with suppress(RigError):  # it may have ended with the test
        os.kill(_daemon_of(folder), signal.SIGTERM)
    run_program("tmux", "-S", found.socket, "kill-server", code=None)


@_NEEDS_TMUX
@pytest.mark.parametrize(
    "url", ["sim://?seed=3", pytest.param("emu://?seed=3", marks=pytest.mark.slow)]
)
def test_a_session_by_keys_alone(terminal, url):
    if url.startswith("emu"):
        pytest.importorskip("rig_emulator.stand")
    session = terminal.begins(url)
    for number, chain in enumerate("AB", start=1):
        terminal.sees(f"Run {number} of 2", f"chain {chain} strikes", "Still ✓", "Enter arm")
        if number == 2:  # typed and pasted: neither words nor the Enter behind them arm
            terminal.press("-l", "hm u\r\r\r")
            terminal.sees("not armed: Enter came too soon after another key")
            terminal.sees("Run 2 of 2", "Enter arm")
        terminal.drops(number)
        terminal.enters("RESULT")
    terminal.sees("2 of 2 runs", "✓✓")
    pid = _daemon_of(terminal.folder)
    terminal.press("q")
    terminal.sees("Quit?")
    terminal.enters("Quit?")
    os.kill(pid, 0)  # it is there without the screen
    os.kill(pid, signal.SIGTERM)
    assert_whole(session, 2)


def test_keys_have_one_reader_after_the_program_was_stopped(monkeypatch):
    begins, ends = "start_application_mode", "disable_input"
    done = []

    def begin(_):
        done.append(begins)
        if len(done) == 1:  # while the terminal is being set up
            signal.raise_signal(signal.SIGCONT)

    monkeypatch.setattr(LinuxDriver, begins, begin)
    monkeypatch.setattr(LinuxDriver, ends, lambda _: done.append(ends))

    async def work():
        terminal = keyboard.Terminal(Mock(), size=(80, 24))
        monkeypatch.setattr(terminal, "write", Mock())
        terminal.start_application_mode()
        assert done == [begins]
        await asyncio.sleep(0)
        terminal.suspend_application_mode()  # as Ctrl-Z has it
        signal.raise_signal(signal.SIGCONT)

    handlers = {number: signal.getsignal(number) for number in (signal.SIGTSTP, signal.SIGCONT)}
    try:
        asyncio.run(work())
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    assert done == [begins, ends, begins, ends, begins]


def _daemon_of(folder):
    from rig.daemon.client import Client, Line

    client = Client(Line(folder / "rig.sock", "a test"))
    try:
        return int(client.line.daemon["pid"])
    finally:
        client.close()

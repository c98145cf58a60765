"""What is no file is refused in words wherever a file is wanted: it might never end."""

import argparse
import os
import re
import shutil
import signal
import socket
import sys

import pytest

from rig.bundle.archive import list_hashes, pack
from rig.cli import _parser
from rig.errors import InputError
from rig.files import write_atomic
from tests.cli.lab import ROOT, command
from tests.programs import run_program
from tests.refusals import refused
from tests.tables import read_table
from tests.waiting import PATIENCE_S

FILES = read_table(__file__, "commands")["files"]
COMMANDS = {(name, file): words for name, of in FILES.items() for file, words in of.items()}
WRITTEN = {("import", "session"), ("tui", "protocol"), ("tui", "session")}
"""A new file, and those that are only read on a terminal."""


@pytest.fixture
def places(tmp_path, finished, fence):
    """What stands for the words of `COMMANDS`."""
    session, csv = tmp_path / "session", tmp_path / "edges.csv"
    shutil.copy(finished.session, session)
    csv.write_text("run,channel,time_s,state\n1,0,0.1,1\n", "utf-8")
    bundle = tmp_path / "b.eln"
    bundle.write_bytes(pack(list_hashes({"a": b""})))
    return {
        "BUNDLE": bundle,
        "SESSION": session,
        "CSV": csv,
        "FENCE": fence,
        "OUT": tmp_path / "out",
    }


def bind(path):
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(path))


NO_FILES = {
    "pipe": os.mkfifo,
    "folder": os.mkdir,
    "socket": bind,
    "device": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.fixture
def thing(request, tmp_path):
    """Make what is no file."""
    NO_FILES[request.param](tmp_path / "thing")
    return tmp_path / "thing"


@pytest.fixture(autouse=True)
def _patience():
    """Let a read that never ends fail, as no error that a command may take for its own."""

    def over(*_):
        pytest.fail("a read that never ends")

    before = signal.signal(signal.SIGALRM, over)
    signal.alarm(int(PATIENCE_S))
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def test_every_command_that_takes_a_file_is_tried():
    (commands,) = (
        action for action in _parser()._actions if isinstance(action, argparse._SubParsersAction)
    )
    files = {"protocol", "session", "events", "video", "learned", "hex", "keys", "file"}
    files |= {"sign", "key"}
    taken = {
        (name, action.dest)
        for name, parser in commands.choices.items()
        for action in parser._actions
        if action.dest in files and action.nargs != 0
    }
    assert taken == COMMANDS.keys() | WRITTEN


# One function looks what is there: every command asks it, and it knows every kind.
@pytest.mark.parametrize(
    ("case", "thing"),
    [
        *((case, "pipe") for case in COMMANDS),
        *((("check", "protocol"), kind) for kind in ("folder", "socket", "device")),
        *((("analyze", "session"), kind) for kind in ("folder", "socket", "device")),
    ],
    indirect=["thing"],
    ids=lambda value: value if isinstance(value, str) else "-".join(value),
)
def test_what_is_no_file_is_refused_in_words(case, thing, places, request, call):
    words = [str({**places, "X": thing}.get(word, word)) for word in COMMANDS[case].split()]
    done = call(case[0], *words, code=4 if case[0] == "doctor" else 2)
    kind = request.node.callspec.params["thing"]
    assert f"it is a {kind}" in done.out + done.err
    assert re.search(r"thing|/dev/zero", done.out + done.err)
    assert not places["OUT"].exists()


@pytest.mark.parametrize("said", ["check <(cat FENCE)", "check /dev/stdin < FENCE"])
def test_a_shell_may_pass_on_text(said, fence, call):
    line = said.replace("FENCE", str(fence))
    done = run_program("bash", "-c", f"{' '.join(command())} {line}", cwd=ROOT)
    assert done.stdout.splitlines()[1:] == call("check", fence).out.splitlines()[1:]


def test_output_goes_into_any_pipe():
    code = f"from {write_atomic.__module__} import write_atomic; write_atomic('/dev/stdout', 'x')"
    assert run_program(sys.executable, "-c", code).stdout == "x"


def test_nothing_takes_the_place_of_a_session(finished):
    refused(InputError, "a session is there", write_atomic, finished.session, "a page")

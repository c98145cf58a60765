"""Bad arguments, bad files, closed pipes: one located line a problem, and never a traceback."""

import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rig.commands import output
from rig.session.store import Session
from tests.cli.lab import PROTOCOLS, ROOT, Terminal, command, rig
from tests.programs import run_program
from tests.tables import cases


@cases
def test_a_port_that_cannot_be_opened_is_device_trouble(
    call, protocol, tmp_path, port, said, monkeypatch
):
    monkeypatch.setattr("rig.recorder.recorder.BOOT_WAIT_S", 0.0)
    monkeypatch.setattr("rig.link.client.LOADER_WAIT_S", 0.0)
    monkeypatch.setattr("rig.link.exchange._LONGEST_WAIT_S", 0.0)
    assert said in call("run", protocol, "--port", port, "--session", tmp_path / "s", code=4).err
    if port != "loop://":  # it was never opened
        assert not (tmp_path / "s").exists()
        return
    with Session.open(tmp_path / "s") as session:
        assert not session.simulated
        assert session.states() == []


# ------------------------------------------------- where the output goes


def test_a_reader_that_leaves_in_the_middle_is_no_error(finished, tmp_path):
    """As in ``rig analyze --json | head -1``."""
    arguments = command("analyze", finished.copy(tmp_path), "--json")
    with subprocess.Popen(
        arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout.read(1) == b"{"
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0


@pytest.mark.parametrize("stream", [io.StringIO, Terminal])
def test_sentences_are_broken_on_terminals_only(stream, monkeypatch):
    lines = ["  a   row that is wider than the terminal   " + "x" * 60, "  run 3: " + "why " * 30]
    monkeypatch.setattr("sys.stdout", stream())
    monkeypatch.setenv("COLUMNS", "80")
    output.show(lines)
    row, *sentence = sys.stdout.getvalue().splitlines()
    assert row == lines[0]
    if stream is io.StringIO:
        assert sentence == lines[1:]
    else:
        assert max(map(len, sentence)) <= 80
        assert [line.startswith("    why") for line in sentence] == [False, True]


def test_a_full_disk_behind_stdout_is_told(finished):
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = rig("predict", finished.protocol, stdout=full, code=2)
    assert done.err == "rig: [Errno 28] No space left on device\n"


@pytest.mark.parametrize("closed", ["1", "2"])
def test_streams_may_be_closed(call, finished, closed):
    words = "predict", finished.protocol
    done = run_program("sh", "-c", f'exec "$@" {closed}>&-', "sh", *command(*words), cwd=ROOT)
    assert done.stderr == ""
    assert done.stdout == ("" if closed == "1" else call(*words).out)


@cases
def test_a_command_that_nobody_listens_to_keeps_its_exit_code(
    tmp_path, fence, unread, code, streams, arguments
):
    """As before ``| head -1``: Python tries to write once more as it ends, and exits with 120."""
    names = {"PLACE": str(tmp_path), "FENCE": str(fence)}
    words = [re.sub("PLACE|FENCE", lambda name: names[name[0]], word) for word in arguments]
    rig(*words, **dict.fromkeys(streams, unread), code=code)


def test_names_need_not_be_utf_8(tmp_path, fence):
    session = os.fsdecode(os.fsencode(tmp_path) + b"/\xff.session")
    rig("run", fence, "--port", "sim://", "--session", session)


def test_a_terminal_without_greek_letters_is_served(finished):
    environment = os.environ | {"PYTHONIOENCODING": "latin-1"}
    done = rig("predict", finished.protocol, env=environment, encoding="latin-1")
    assert done.err == ""
    assert "?z ± U (cm)" in done.out


def test_what_only_the_system_refuses_is_said_without_numbers():
    session, fence = 300 * "x", PROTOCOLS / "picket-fence.yaml"
    done = rig("run", fence, "--port", "sim://", "--session", session, code=2)
    said = f"{Path(session).absolute()}: File name too long\n  hint: name another file\n"
    assert done.err == said


WITHOUT_MPMATH = """
import sys
sys.modules["mpmath"], sys.executable = None, "/a lab/bin/python"
from rig import cli
sys.exit(cli.main(["bench", "stability"]))
"""


def test_a_missing_package_is_named_with_a_command_that_brings_it():
    """In a process of its own: modules loaded a second time would stay behind for other tests."""
    done = run_program(sys.executable, "-c", WITHOUT_MPMATH, code=None)
    wanted = "rig: this needs mpmath: '/a lab/bin/python' -m pip install mpmath\n"
    assert (done.returncode, done.stderr) == (2, wanted)

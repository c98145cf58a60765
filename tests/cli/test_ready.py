"""Protocols by name, the only board by `auto`, and `rig` alone."""

import subprocess
from contextlib import ExitStack

import pytest

from rig.ready import find_protocol, ready_protocols
from rig.usb.listing import SerialPort
from tests.cli.lab import PROTOCOLS, command
from tests.tables import cases
from tests.waiting import until


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_ready_protocol_is_listed_with_its_title(call):
    rows = call("ready").out.splitlines()
    assert {row.split()[0] for row in rows} == {path.stem for path in PROTOCOLS.glob("*.yaml")}
    assert "A ball past four gates" in next(row for row in rows if row.startswith("falling-ball"))


def test_a_file_in_the_folder_wins(folder):
    ready = str(ready_protocols()["glider"])
    assert find_protocol("glider") == ready
    (folder / "glider").mkdir()
    assert find_protocol("glider") == ready
    (folder / "glider.yaml").touch()
    assert find_protocol("glider") == "glider.yaml"
    (folder / "glider").rmdir()
    (folder / "glider").touch()
    assert find_protocol("glider") == "glider"
    for other in ("nothing", "/dev/fd/63", "x" * 300, "a\0b", ""):
        assert find_protocol(other) == other


@cases
def test_no_board_and_several_are_said(folder, monkeypatch, call, paths, sentence):
    plug(monkeypatch, *paths)
    done = call("run", "falling-ball", "--port", "auto", "--session", "s", code=4)
    assert done.err.startswith(f"{sentence}\n")


def test_the_only_board_is_taken(folder, monkeypatch, call):
    plug(monkeypatch, str(folder / "ttyACM7"))
    assert f"{folder / 'ttyACM7'}" in call("selftest", "--port", "auto", code=4).err


def plug(monkeypatch, *paths):
    ports = [SerialPort(path) for path in paths] + [SerialPort("/dev/modem", skipped="a modem")]
    monkeypatch.setattr("rig.usb.listing.serial_ports", lambda: ports)


@pytest.mark.parametrize("seen", [True, False])
def test_rig_alone_opens_the_terminal_where_there_is_one(monkeypatch, call, seen):
    shown = []
    monkeypatch.setattr("rig.commands.tui.main", lambda arguments: shown.append(arguments) or 0)
    for stream in ("stdin", "stdout"):
        monkeypatch.setattr(f"sys.{stream}.isatty", lambda: seen)
    assert ("usage: rig" in call(code=0 if seen else 2).err) != seen
    assert len(shown) == seen


@cases
def test_a_run_goes_through_the_daemon_that_is_named_or_has_its_port(
    folder, call, monkeypatch, runs
):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    with ExitStack() as stack:
        for file, name in (("rig.sock", []), ("rig-left.sock", ["--name", "left"])):
            line = command("daemon", "--port", "sim://", *name)
            process = stack.enter_context(subprocess.Popen(line, stderr=subprocess.DEVNULL))
            stack.callback(process.terminate)
            until((folder / "chainrig" / file).exists)
        for number, (words, code, said) in enumerate(runs):
            session = f"falling-ball --session {number}.session --yes"
            found = call("run", *session.split(), *words.split(), code=code).err
            assert said in found
            assert ("through the" in found) == ("through the" in said)

"""What the doctor finds on a computer, a board and in a session, and the command as a whole."""

import os
import random
import re
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from rig.doctor.board import BOARD_CHECKS, mains_ripple
from rig.doctor.computer import PORT_CHECKS, check_packages, check_room
from rig.doctor.session import check_restarts, check_session, describe_supply
from rig.errors import DeviceError
from rig.link import messages as wire
from rig.link.transcript import Restart
from rig.records import Certificate, Drop
from rig.selftest.board import BoardUnderTest, SelftestOptions
from rig.selftest.findings import Verdict, make_check
from rig.selftest.run import run_checks
from rig.session.store import Session
from rig.streams import runnable
from tests.flash.pty_board import PtyBoard, silent_port
from tests.refusals import refused
from tests.selftest.benches import LoopedBoard, fire_drop, hold_drop, port_of, wired
from tests.selftest.broken import claims, odd
from tests.session.altering import alter
from tests.tables import cases

HZ = 16_000_000


def findings(board=None, port=None):
    """What the doctor finds on a board, or at a port."""
    port = port or port_of(board)
    checked = run_checks(BOARD_CHECKS, BoardUnderTest(port, SelftestOptions()))
    return {finding.name: finding for finding in checked}


def calm(*changes, **settings):
    """Build a board at which nothing moves, but what the lab is told."""
    (lab := wired()).changes = list(changes)
    return LoopedBoard(lab, **settings)


def test_a_good_board_is_well_and_nothing_is_driven():
    board = calm()
    found = findings(board)
    assert [str(finding) for finding in found.values() if finding.advice] == []
    assert found["firmware"].what == "sim; none for a virtual comes with rig"
    assert (board.driven, board.outputs()) == (0, 0)


def flicker(gate, first_s, every_s, count, dark_s):
    times_s = [first_s + every_s * n for n in range(count)]
    return [(time + dark_s * (not on), gate, on) for time in times_s for on in (True, False)]


LIGHT = "stop and flickering gates"


@cases
def test_what_is_wrong_is_said_with_what_to_do(board, flickers, check, says, advises):
    blinks = sorted(blink for each in flickers for blink in flicker(*each))
    there = calm(*map(tuple, board.get("changes", ())), *blinks, ppm=board.get("ppm", 0.0))
    there.identity = replace(there.identity, **board.get("names", {}))
    there.stop(board.get("stopped", False))
    finding = findings(there)[check]
    assert says in finding.what
    assert advises in finding.advice
    assert finding.verdict is Verdict.FAILED
    assert "\n  do: " in str(finding)
    assert finding.json()["reason_codes"] == [finding.reason.json()]
    assert not re.search(r"[{}]", str(finding))


@pytest.mark.parametrize(
    "reason", [wire.RefusalReason.GATE_BLOCKED, wire.RefusalReason.GATE_UNSTEADY]
)
@pytest.mark.parametrize("times", [3, 100])
def test_a_gate_that_forbids_firing_now_and_then_is_tried_again(reason, times, monkeypatch):
    refusals = iter([wire.Refused(reason, 4)] * times)
    restless = odd(_fire=lambda _, usual, request: next(refusals, None) or usual(request))
    monkeypatch.setattr("sim.board.Microcontroller", restless)
    finding = findings(calm())[LIGHT]
    assert (finding.verdict is Verdict.OK) is (times == 3)
    assert times == 3 or finding.reason.code == "gates_flicker"


def test_an_input_without_a_gate_is_a_note(monkeypatch):
    monkeypatch.setattr("sim.board.Microcontroller", claims(gates=("or_", 1 << 6)))
    board = LoopedBoard(wired(None, blocked=1 << 6))
    found = findings(board)
    assert found["gates"].verdict is Verdict.NOT_POSSIBLE
    assert found["gates"].what.endswith("gate 6 blocked all the time")
    assert found[LIGHT].what == "none within 1 s"


def test_a_drop_of_a_session_is_not_touched():
    port = port_of(calm())
    device, label, drop = hold_drop(port, 3)
    found = findings(port=port)
    assert found["held drop"].reason.values == {"run": 3, "attempt": 2}
    assert "rig run" in found["held drop"].advice
    assert found[LIGHT].verdict is Verdict.NOT_POSSIBLE
    assert device.fetch(label) == drop


@pytest.mark.parametrize("hz", [50, 60, 100, 120])
@pytest.mark.parametrize("jitter_s", [0.0, 3e-4])
def test_the_mains_rhythm_is_found(hz, jitter_s):
    noise = random.Random(hz)
    times = [0.0031 + n / hz + noise.gauss(0, jitter_s) for n in range(hz)]
    assert mains_ripple(times) == hz
    assert mains_ripple(noise.sample(times, hz // 2)) == hz  # half of them missed


def test_chance_and_other_rhythms_are_not_the_mains():
    for seed in range(20):
        noise = random.Random(seed)
        assert mains_ripple([noise.random() for _ in range(noise.randrange(1, 200))]) is None
    for hz in (37, 55, 80, 173):
        assert mains_ripple([n / hz for n in range(hz)]) is None


def test_restarts_that_only_certificates_tell_of_and_a_supply_that_sinks():
    name = "run 3, attempt 1"
    seen = Certificate(0, 0, restarts=128 | 4 | 8, supply_mv=4960, lowest_mv=4310)
    drops = [Drop(3, 1, HZ, (), certificate=seen), Drop(4, 1, HZ, ())]
    restarts = make_check("restarts", check_restarts, [], drops)
    assert restarts.what == f"{name}: before it, unseen (brown-out, watchdog)"
    assert "supply shared with the magnets" in restarts.advice
    assert describe_supply(drops) == f"at most from 4.96 V to 4.31 V, in {name}"
    assert (check_restarts([], drops[1:]), describe_supply(drops[1:])) == ("none", "not measured")
    twice = make_check("restarts", check_restarts, [Restart(1, 0), Restart(2, 0)], [])
    assert twice.what == "while nothing fell, 2 times"


@pytest.fixture
def terminal():
    with silent_port() as path:
        yield path


@pytest.fixture
def process(tmp_path, monkeypatch):
    """Give a /proc of some processes, which may have a port open."""
    monkeypatch.setattr("rig.doctor.computer._PROC", tmp_path / "proc")

    def make(pid, words, *paths):
        folder = tmp_path / "proc" / str(pid)
        (folder / "fd").mkdir(parents=True)
        (folder / "cmdline").write_bytes(b"\0".join(words) + b"\0")
        for number, path in enumerate(paths):
            (folder / "fd" / str(number)).symlink_to(path)

    return make


def verdicts(port):
    """What the doctor says of a port, and what to do: of permission, owners and ModemManager."""
    findings = [make_check(name, check, Path(port)) for name, check in PORT_CHECKS.items()]
    return [(finding.what, finding.advice) for finding in findings]


@cases
def test_who_has_a_port_open(words, advises, terminal, process):
    process(7, [b"sleep"], "/dev/null")
    process(os.getpid(), [b"this"], terminal)
    process(4711, [words.encode(), terminal.encode()], "/dev/null", terminal)
    permission, owners, modem = verdicts(terminal)
    assert permission == ("given", "")
    assert owners[0] == f"{words} {terminal} (process 4711)"
    assert advises in owners[1]
    assert modem == ("it does not run", "")


def test_modem_manager_and_what_udev_tells_it(terminal, process, tmp_path, monkeypatch):
    process(9, [b"/usr/sbin/ModemManager", b"--debug"])
    monkeypatch.setattr("rig.doctor.computer._UDEV", tmp_path)
    assert "rig.usb.udev" in verdicts(terminal)[2][1]
    number = Path(terminal).stat().st_rdev
    account = tmp_path / f"c{os.major(number)}:{os.minor(number)}"
    account.write_text("E:ID_BUS=usb\nE:ID_MM_DEVICE_IGNORE=1\n")
    assert verdicts(terminal)[1:] == [
        *(("none seen", ""), ("it is told to leave this port alone", ""))
    ]


@cases
def test_a_port_that_is_forbidden(group, says, advises, terminal, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)  # root may do everything
    named = {"return_value": group} if group else {"side_effect": KeyError}
    monkeypatch.setattr(Path, "group", Mock(**named))
    permission = verdicts(terminal)[0]
    assert says in permission[0]
    assert advises in permission[1]
    assert ("usermod" in permission[1]) is (group != "root")


def test_room_where_a_session_will_be(tmp_path, monkeypatch):
    for free, says, advises in ((10**9, "1000 MB free in", ""), (10**7, "10 MB", "free 200 MB")):
        monkeypatch.setattr("shutil.disk_usage", lambda _, free=free: SimpleNamespace(free=free))
        finding = make_check("disk", check_room, tmp_path / "not" / "yet")
        assert finding.what.startswith(says)
        assert finding.what.endswith(str(tmp_path))
        assert advises in finding.advice


def test_a_session(tmp_path):
    path = tmp_path / "s.session"
    with Session.create(path, "x", "x.yaml", simulated=True, origin="x"):
        written, *_ = check_session(str(path))
    assert written.what == f"whole, being written by process {os.getpid()}"
    whole = [(finding.name, finding.what) for finding in check_session(str(path))]
    assert whole == [
        *((f"session {path}", "whole"), ("restarts", "none"), ("supply", "not measured"))
    ]
    alter(path, "DELETE FROM meta WHERE key = 'simulated'")
    (damaged,) = check_session(str(path))
    assert damaged.what.startswith("damaged: ")
    assert damaged.what.endswith("s.session: it does not say simulated")
    assert damaged.advice == f"rig recover {path} -o NEW.session"


# -- the command


packages_here = cache(check_packages)  # which takes longer than all that a command looks at else


@pytest.fixture
def doctor(call, monkeypatch, tmp_path):
    monkeypatch.setattr("rig.doctor.computer.check_packages", packages_here)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    return partial(call, "doctor")


def test_a_board_at_a_terminal(doctor):
    with PtyBoard() as there:
        done = doctor("--port", there.path)
    assert f"permission for {there.path}: ok: given" in done.out
    assert "stop and flickering gates: ok: none within 1 s" in done.out
    assert done.err == "nothing to do\n"


def test_a_port_that_is_not_there_is_not_opened(doctor):
    done = doctor("--port", "/dev/nosuch", code=4)
    assert done.err == "1 thing to do\n"
    assert "permission for /dev/nosuch: failed: there is no such port\n  do: is the " in done.out
    assert "board: not possible here: its port cannot be used now\n" in done.out


@cases
def test_programs_read_codes(finding, doctor, tmp_path):
    done = doctor("--json", "--session", tmp_path / "none", code=4)
    assert done.err == "1 thing to do\n"
    name = f"session {tmp_path / 'none'}"
    assert done.json["findings"][-1] == {"name": name, **finding}


def test_a_restart_in_a_drop_is_timed_and_found_again_in_the_session(doctor, tmp_path):
    path = tmp_path / "s.session"
    with Session.create(path, "x", "x.yaml", simulated=True, origin="x") as session:
        port = port_of(LoopedBoard(wired(None)))
        device, label = fire_drop(port, 3, session.log_bytes)
        port.clock.sleep(0.004)
        port.board.brown_out(port.clock.now_ns())
        said = (
            r"the board restarted about [45] ms after FIRE: is its supply shared with the magnets\?"
        )
        refused(DeviceError, said, device.collect, label)
    done = doctor("--session", path, code=4)
    found = (
        r"^restarts: failed: run 3, attempt 2: about [45] ms after FIRE \(brown-out\)\n  do: is "
    )
    assert re.search(found, done.out, re.MULTILINE)


def test_without_a_port_nothing_is_opened_and_a_damaged_session_is_said(doctor, tmp_path):
    doctor()
    (tmp_path / "s").write_text("no session")
    done = doctor("--session", tmp_path / "s", code=4)
    assert "not a session: there is nothing of a session in it\n  do: " in done.out
    assert runnable("rig run") in done.out  # as this user can type it


@cases
def test_what_rig_needs_is_listed_and_what_lacks_or_mixes_with_it(
    packages, says, advises, tmp_path, monkeypatch
):
    for name, module in packages.items():
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        needs = "Requires-Dist: pyserial>=3.5\nRequires-Dist: pint>=0.24; extra == 'dev'\n"
        about = f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"
        (info / "METADATA").write_text(about + needs * (name == "chainrig"))
        (info / "RECORD").write_text(f"{module}/__init__.py,,\n")
        (tmp_path / module).mkdir(exist_ok=True)
        (tmp_path / module / "__init__.py").touch()  # only what is there counts for some
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    finding = make_check("packages", check_packages, "chainrig")
    assert finding.what.startswith(says)
    assert advises in finding.advice
    assert bool(advises) is bool(finding.advice)

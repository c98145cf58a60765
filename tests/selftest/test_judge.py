"""``rig selftest --judge``: two emulated Picos, joined pin to pin as docs/first-board.md says."""

import re
from itertools import islice

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link.client import Device
from rig.selftest.board import SelftestOptions
from rig.selftest.findings import Verdict
from rig.selftest.run import CHECKS, selftest
from rig_emulator.pico_board import USB_RATE, EmulatedPico
from rig_emulator.protocol_emu import EmulatedSerial
from rig_emulator.wiring import PICO
from sim.clock import VirtualClock
from tests.firmware.pico import build
from tests.firmware.toolchain import FIRMWARE

PPM = 30.0, -12.0
DROPS = 4


class Pair:
    """A board and its judge, on a bench."""

    def __init__(self):
        clock = VirtualClock()
        self.board, judge = (
            EmulatedPico(PICO, build(), seed=n, ppm=ppm, baudrate=USB_RATE)
            for n, ppm in enumerate(PPM)
        )
        self.board.beside, judge.beside = judge, self.board
        beams = [(self.board, pin) for pin in PICO.gates[:15]]
        stop = [(self.board, pin) for pin in (PICO.stop, PICO.gates[15])]
        judge.wires = dict(zip(PICO.releases, (beams, stop), strict=True))
        outputs = (PICO.releases[0], PICO.sync)
        self.board.wires = {p: [(judge, PICO.gates[n])] for n, p in enumerate(outputs)}
        self.judge = judge
        self.port, self.judge_port = (
            EmulatedSerial("test", board=one, timeout=0.02, clock=clock, reset_on_open=False)
            for one in (self.board, judge)
        )

    def findings(self, drops=DROPS):
        options = SelftestOptions(drops=drops, release=True)
        return selftest(self.port, options, self.judge_port)


@pytest.fixture(scope="module")
def pair():
    """Two boards that have started, which takes long; what a test changes, it changes back."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Device.connect, "__defaults__", (0.0,))  # opening restarts none of them
        patch.setattr("rig.selftest.run.CHECKS", dict(islice(CHECKS.items(), 1)))
        # A release rests three times as long as it was on.
        patch.setattr("rig.selftest.judge._LONG_US", 40_000)
        patch.setattr("rig.selftest.judge._PULSES_US", (100, 1_000, 20_000, 40_000))
        yield Pair()


@pytest.fixture
def late(pair, monkeypatch):
    """Have one comparator slower than the others."""
    edge = pair.board.avr.edge

    def by(late_ns):
        def later(cycle, pin, level):
            edge(cycle + round(late_ns * 0.12) * (pin == "GP3"), pin, level)

        monkeypatch.setattr(pair.board.avr, "edge", later)

    return by


def test_a_right_board_is_measured_as_the_emulator_itself_measures_it(pair):
    found = {finding.name: finding for finding in pair.findings()}
    assert {str(f) for f in found.values() if f.verdict is not Verdict.OK} == set()
    (ppm,) = map(float, re.findall(r"clock (\S+) ppm", found["stamps"].what))
    assert ppm == pytest.approx(PPM[0] - PPM[1], abs=1.0)  # two ticks in 40 ms
    table = (FIRMWARE.parent / "docs" / "results" / "boards.md").read_text("utf-8")
    ((_, sd),) = re.findall(r"stamp, standard deviation \| (\d+) ns \| (\d+) ns", table)
    scatter, worst, skew = map(int, re.findall(r"(\d+) ns", found["stamps"].what))
    assert int(sd) / 2 < scatter < 2 * int(sd)
    assert worst < 100  # two stamps, each within a tick
    assert skew == 0
    assert max(map(int, re.findall(r"(\d+) ns", found["release pulse"].what))) <= 75
    assert 300 <= int(re.findall(r"after (\d+) µs", found["emergency stop"].what)[0]) < 1000
    assert len(found) == 7


def test_a_gate_that_is_a_little_late_is_right_and_a_wire_that_is_missing_asked_for(
    pair, late, monkeypatch
):
    late(40)
    monkeypatch.delitem(pair.board.wires, PICO.releases[0])
    found = {finding.name: finding for finding in islice(pair.findings(drops=2), 4)}
    assert found["stamps"].verdict is Verdict.OK
    assert found["release pulse"].reason.code == "judged_edges"


def test_wires_to_the_gates_that_are_missing_are_asked_for(pair, monkeypatch):
    monkeypatch.setattr(pair.judge, "wires", {})
    *_, stamps = islice(pair.findings(), 3)
    assert stamps.reason.code == "judged_edges"
    assert "docs/first-board.md" in stamps.advice


def test_a_gate_that_is_too_late_is_found_out(pair, late):
    late(2_000)
    *_, stamps = islice(pair.findings(drops=1), 3)
    assert stamps.reason.code == "judged_limit"

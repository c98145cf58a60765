"""Anything at all before the real binaries: no pulse that was not asked for, none too long."""

from __future__ import annotations

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig.link import messages as wire
from rig_emulator.controller import Change
from rig_emulator.fuzz import Fuzz, Judge
from rig_emulator.wiring import BOARDS, PICO, firmware_for
from tests.firmware.pico import build
from tests.firmware.toolchain import make

ORDER = wire.Arm(1, 1, 0b01, 1000, 200, 50)
LIMIT = 16_000  # cycles


def judge_pulses(wiring, steps: int, least: int) -> None:
    fuzz = Fuzz(wiring, firmware_for(wiring), seed=3)
    for _ in range(steps):
        fuzz.step()
    assert fuzz.judge.faults == []
    assert fuzz.judge.pulses["ordered"] >= least, "or else this would show nothing"
    assert fuzz.avr.watchdog_resets == 0


@pytest.mark.parametrize("name", BOARDS)
def test_every_pulse_was_armed_and_fired(name):
    make("all")
    judge_pulses(BOARDS[name], steps=250, least=5)


@pytest.mark.parametrize(
    ("steps", "least"), [(25, 1), pytest.param(1000, 20, marks=pytest.mark.slow)]
)
def test_every_pulse_of_a_pico_was_too(steps, least):
    build()
    judge_pulses(PICO, steps, least)


def judged(*said, until=1000 + LIMIT, pin="PE3"):
    judge = Judge(("PE3", "PE5"), us=16)
    for what in said:
        what(judge)
    judge.change(Change(1000, pin, True))
    judge.change(Change(until, pin, False))
    return judge


def armed(judge):
    judge.armed(7, ORDER)


def fired(judge):
    judge.fire(7)


@pytest.mark.parametrize(
    "said",
    [
        (),
        (armed,),
        (fired,),
        (armed, lambda judge: judge.fire(8)),
        (armed, fired, Judge.restarted),
        (armed, fired, lambda judge: judge.armed(9, ORDER)),
        (armed, fired, lambda judge: judge.change(Change(5, "PE3", True))),
    ],
    ids=["nothing", "no FIRE", "no ARM", "wrong token", "restart", "armed anew", "twice"],
)
def test_the_judge_notices_a_pulse_without_arm_and_fire(said):
    assert any("went on at 1000 without ARM and FIRE" in fault for fault in judged(*said).faults)


def test_the_judge_notices_another_output_and_a_pulse_that_is_too_long():
    assert judged(armed, fired, pin="PE5").faults
    (fault,) = judged(armed, fired, until=1000 + 2 * LIMIT).faults
    assert "was on for 32000 cycles" in fault

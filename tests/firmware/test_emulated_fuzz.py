"""Anything at all before the real binaries: no pulse that was not asked for, none too long."""

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig_emulator.fuzz import Fuzz
from rig_emulator.wiring import BOARDS, PICO, firmware_for
from tests.firmware.pico import build
from tests.firmware.toolchain import make


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
    judge_pulses(BOARDS[name], steps=150, least=3)


@pytest.mark.parametrize(
    ("steps", "least"), [(25, 1), pytest.param(1000, 20, marks=pytest.mark.slow)]
)
def test_every_pulse_of_a_pico_was_too(steps, least):
    build()
    judge_pulses(PICO, steps, least)

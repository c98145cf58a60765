"""The rig's firmware beside ordinary sketches: the bench's rivals do what they say they do."""

from __future__ import annotations

import pytest

import tests.firmware.emulated  # noqa: F401 - first: it knows what to say when there is none
from rig_emulator import rivals, trials
from rig_emulator.wiring import BOARDS
from tests.firmware.toolchain import need


def seen_by(name: str, folder, count: int, rate: float) -> tuple[trials.Spread, int]:
    need("avr-gcc")
    program = rivals.compile_sketch(name, "atmega2560", folder)
    account = rivals.drop(BOARDS["mega"], program, trials.train(16, count, rate))
    return trials.spread(account.stamps), account.lost


@pytest.mark.parametrize("name", ["micros() in an interrupt", "polling, printed later"])
def test_a_sketch_with_micros_has_steps_of_4_us(name, tmp_path):
    seen, lost = seen_by(name, tmp_path, 400, 600)
    assert lost == 0
    # Steps of 64 cycles alone have an sd of 18; the interrupt or the loop adds its own.
    assert 64 / 12**0.5 < seen.sd < 64


def test_printing_at_once_costs_edges_when_they_come_fast(tmp_path):
    slow, none_lost = seen_by("polling, printed at once", tmp_path, 40, 60)
    fast, lost = seen_by("polling, printed at once", tmp_path, 700, 4000)
    assert none_lost == 0 < lost
    assert fast.sd > 10 * slow.sd

# SPDX-License-Identifier: GPL-3.0-or-later
"""Ordinary timing sketches on the same stand, to see what the rig's firmware is worth."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import DeviceError
from rig_emulator.avr import Avr
from rig_emulator.pico_chip import PicoChip
from rig_emulator.stand import Stamp
from rig_emulator.wiring import PICO

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig_emulator.stand import Flip
    from rig_emulator.wiring import Wiring

_CYCLES_PER_US = 16
_PICO = "pico_polling.c"
_PICO_START_US = 30_000
_NM = "arm-none-eabi-nm"
_WARM_UP = 200_000
_LATEST = 320_000  # cycles after a flip at which an event can still be its own
SOURCES = Path(__file__).parents[1] / "rivals"
SKETCHES = {
    "micros() in an interrupt": ("micros_isr.c",),
    "polling, printed at once": ("polling.c",),
    "polling, printed later": ("polling.c", "-DPRINT_LATER"),
}


class Account(NamedTuple):
    """What a sketch made of a drop."""

    stamps: list[Stamp]
    lost: int


def compile_sketch(name: str, mcu: str, folder: Path) -> Path:
    """Compile one of `SKETCHES` as the Arduino tools would, with -Os.

    Raises
    ------
    DeviceError
        When the compiler is not there or does not like it.
    """
    source, *flags = SKETCHES[name]
    program = folder / f"{mcu}-{len(name)}.elf"
    options = ["-Os", "-std=gnu11", "-DF_CPU=16000000UL", f"-mmcu={mcu}", *flags]
    command = ["avr-gcc", *options, str(SOURCES / source), "-o", str(program)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise DeviceError(f"cannot compile {source}: {error}", "apt-get install gcc-avr") from None
    return program


def drop(wiring: Wiring, program: Path, flips: Sequence[Flip]) -> Account:
    """Let gates change before a sketch, and read its memory afterwards."""
    avr = Avr(program, wiring.mcu)
    for pin in wiring.gates:
        avr.edge(0, pin, False)
    avr.run(_WARM_UP)
    avr.watch(wiring.releases[0])
    avr.receive(b"g")
    while not (risen := [c for c in avr.take_changes() if c.pin == wiring.releases[0]]):
        avr.run(avr.cycle + 10_000)
    fire = risen[0].cycle
    for flip in flips:
        avr.edge(fire + flip.cycle, wiring.gates[flip.gate], flip.blocked)
    end = fire + flips[-1].cycle + _LATEST
    while avr.run(end):
        avr.take_changes()
    count, fired = avr.number("count"), avr.number("fired")
    times = _numbers(avr.peek("times"), 4)[:count]
    states = _numbers(avr.peek("states"), 2)[:count]
    return _account(flips, [(t - fired) * _CYCLES_PER_US for t in times], states)


def compile_for_pico(folder: Path) -> Path:
    """Compile the loop of a Pico, with the start-up of the rig's own firmware: a UF2 file.

    Raises
    ------
    DeviceError
        When the compiler is not there or does not like it.
    """
    own, common = SOURCES.parents[1] / "rp2040", SOURCES.parents[1] / "pico"
    elf, flash, image = (folder / f"pico.{kind}" for kind in ("elf", "bin", "uf2"))
    sources = [SOURCES / _PICO, common / "clocks.c", common / "start.S", *own.glob("*.[cS]")]
    options = ["-O2", "-std=gnu11", "-mcpu=cortex-m0plus", "-mthumb", "-ffreestanding", "-nostdlib"]
    places = [f"-I{own}", f"-I{common}", f"-T{common}/image.ld", "-o", str(elf)]
    commands = (
        ["arm-none-eabi-gcc", *options, *places, *map(str, sources), "-lgcc"],
        ["arm-none-eabi-objcopy", "-O", "binary", str(elf), str(flash)],
        [sys.executable, str(common / "image.py"), "0xE48BFF56", str(flash), str(image)],
    )
    try:
        for command in commands:
            subprocess.run(command, check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        hint = "apt-get install gcc-arm-none-eabi"
        raise DeviceError(f"cannot compile {_PICO}: {error}", hint) from None
    return image


def drop_of_pico(image: Path, flips: Sequence[Flip]) -> Account:
    """Let gates change before that loop, and read its memory afterwards.

    Its time begins anywhere, so it is set by its first stamp.
    """
    listed = subprocess.run(
        [_NM, image.with_suffix(".elf")], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    at = {name: int(address, 16) for address, _, name in map(str.split, listed)}
    chip = PicoChip(image, bytes(8))
    for pin in PICO.gates:
        chip.edge(0, pin, False)
    us = PICO.clock_hz // 1_000_000
    chip.run(start := _PICO_START_US * us)
    for flip in flips:
        chip.edge(start + flip.cycle, PICO.gates[flip.gate], flip.blocked)
    chip.run(start + flips[-1].cycle + us * 1000)
    (count,) = _numbers(chip.peek(at["count"], 4), 4)
    times = _numbers(chip.peek(at["times"], 4 * count), 4)
    states = _numbers(chip.peek(at["states"], 2 * count), 2)
    chip.close()
    return _account(flips, [(t - times[0]) * us + flips[0].cycle for t in times], states)


def _account(flips: Sequence[Flip], ticks: Sequence[int], states: Sequence[int]) -> Account:
    """Give each change that was seen to the latest flip that can have made it."""
    made: dict[tuple[int, bool], list[Flip]] = {}
    for flip in flips:
        made.setdefault((flip.gate, flip.blocked), []).append(flip)
    stamps, before = [], 0
    for tick, state in zip(ticks, states, strict=True):
        for gate in range(16):
            if (before ^ state) >> gate & 1:
                waiting = made.get((gate, bool(state >> gate & 1)), [])
                while len(waiting) > 1 and abs(waiting[1].cycle - tick) < abs(
                    waiting[0].cycle - tick
                ):
                    waiting.pop(0)
                if waiting:
                    flip = waiting.pop(0)
                    stamps.append(Stamp(flip, tick - flip.cycle, doubtful=False))
        before = state
    return Account(stamps, len(flips) - len(stamps))


def _numbers(data: bytes, size: int) -> list[int]:
    return [int.from_bytes(data[at : at + size], "little") for at in range(0, len(data), size)]

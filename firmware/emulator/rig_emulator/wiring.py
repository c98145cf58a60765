# SPDX-License-Identifier: GPL-3.0-or-later
"""The boards: what is wired to which pin, and where their firmware is found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import rig
from rig.errors import InputError


@dataclass(frozen=True, slots=True)
class Wiring:
    """A board.

    Attributes
    ----------
    mcu
        Its controller, also the name of its folder in ``firmware/``.
    gates
        Pins of gates 0, 1, …; a blocked beam is a high level.
    releases, sync, led
        Outputs; `sync` is high from FIRE until the recording ends.
    stop
        The emergency stop, low while all is well.
    reference
        Input of the 1 Hz reference; rising edges count.
    sense
        Input that tells that the chain has left, if there is one.
    clock_hz
        Of the controller.
    tick_cycles
        Its cycles in a tick of its stamps.
    sync_lead
        Cycles by which the sync output rises before the releases.
    """

    mcu: str
    gates: tuple[str, ...]
    releases: tuple[str, ...]
    sync: str
    led: str
    stop: str
    reference: str
    sense: str | None
    clock_hz: int = 16_000_000
    tick_cycles: int = 1
    sync_lead: int = 2


def _pins(port: str, first: int, last: int) -> tuple[str, ...]:
    return tuple(f"P{port}{pin}" for pin in range(first, last + 1))


BOARDS = {
    "mega": Wiring(
        mcu="atmega2560",
        gates=_pins("B", 0, 7) + _pins("K", 0, 7),
        releases=("PE3", "PE5"),
        sync="PE4",
        led="PA0",
        stop="PA2",
        reference="PL0",
        sense="PL1",
    ),
    "uno": Wiring(
        mcu="atmega328p",
        gates=_pins("D", 2, 7) + _pins("C", 0, 5),
        releases=("PB1", "PB2"),
        sync="PB3",
        led="PB5",
        stop="PB4",
        reference="PB0",
        sense=None,
    ),
}
"""The AVR boards."""

PICO = Wiring(
    mcu="rp2040",
    gates=tuple(f"GP{pin}" for pin in range(16)),
    releases=("GP16", "GP17"),
    sync="GP18",
    led="GP25",
    stop="GP19",
    reference="GP21",
    sense="GP20",
    clock_hz=120_000_000,
    tick_cycles=6,
    sync_lead=0,
)


def board_named(name: str) -> Wiring:
    """Find a board.

    Raises
    ------
    InputError
        When there is none of that name.
    """
    boards = BOARDS | {"pico": PICO}
    if name not in boards:
        raise InputError(f"emu://: there is no board {name!r}", f"boards are {', '.join(boards)}")
    return boards[name]


def firmware_for(wiring: Wiring) -> Path:
    """Find a board's firmware: freshly built in the source tree, else as the package ships it.

    Raises
    ------
    InputError
        When there is neither.
    """
    package = Path(rig.__file__).parent
    avr = wiring is not PICO
    built = package.parent / "firmware/build" / wiring.mcu / f"firmware.{'elf' if avr else 'uf2'}"
    shipped = package / "flash" / f"{wiring.mcu}.{'hex' if avr else 'uf2'}"
    for path in (built, shipped):
        if path.is_file():
            return path
    raise InputError(
        f"no firmware for {wiring.mcu}",
        f"build it: make -C firmware{'' if avr else ' pico'} ({built})",
    )

"""The boards' pins, read from each `board.h`: what tables and pictures say cannot drift from it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_FIRMWARE = Path(__file__).parent
_PIN = re.compile(r"^#define (\w+) _BV\((P[A-L][0-7])\)\s*/\* (\w+)", re.MULTILINE)
_CHANNELS = re.compile(r'board_channels\[\](?: PROGMEM)? =\s*"([^"]+)"')
_TYPE = re.compile(r'board_type\[\](?: PROGMEM)? = "([^"]+)"')
# The Pico's pins have numbers, and the names printed beside them are made of these.
_EDGE = [*range(2), -1, *range(2, 6), -1, *range(6, 10), -1, *range(10, 14), -1, 14, 15]
_EDGE += [16, 17, -1, *range(18, 22), -1, 22]
"""GPIO at each pin of the Pico's edge, from pin 1 on; -1 for ground."""
_NUMBER = re.compile(r"^#define (RELEASE_[01]|SYNC|STOP|SENSE|REFERENCE|LED) (\d+)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Pins:
    """Where a board is wired.

    Attributes
    ----------
    board
        What the board is called.
    gates
        Pin of each gate as it is printed on the board, from channel 0 on.
    others
        Pin and port of everything else, by its name in `board.h`.
    volts
        What the pins' high level is, and the most they stand.
    led_on_board
        Whether the status LED is on the board already.
    """

    board: str
    gates: tuple[str, ...]
    others: dict[str, tuple[str, str]]
    volts: str
    led_on_board: bool


def read_pins(folder: str) -> Pins:
    """Read the pins of a board.

    Parameters
    ----------
    folder
        The board's folder.

    Returns
    -------
    Pins
        As the firmware uses them.
    """
    text = (_FIRMWARE / folder / "board.h").read_text(encoding="utf-8")
    channels, name = _CHANNELS.search(text), _TYPE.search(text)
    if channels is None or name is None:
        raise ValueError(f"{folder}/board.h names no channels or no board")
    others = {found: (pin, port) for found, port, pin in _PIN.findall(text)}
    numbers = {
        found: (f"GP{pin}", f"{_EDGE.index(int(pin)) + 1}" if int(pin) in _EDGE else "on board")
        for found, pin in _NUMBER.findall(text)
    }
    led, _ = (others | numbers)["LED"]
    return Pins(
        name[1],
        tuple(channels[1].split()),
        others | numbers,
        "+3.3 V" if numbers else "+5 V",
        led in {"D13", "GP25"},
    )

"""The boards' pins, read from each `board.h`: what tables and pictures say cannot drift from it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_FIRMWARE = Path(__file__).parent
_PIN = re.compile(r"^#define (\w+) _BV\((P[A-L][0-7])\)\s*/\* (\w+)", re.MULTILINE)
_CHANNELS = re.compile(r'board_channels\[\] PROGMEM =\s*"([^"]+)"')
_TYPE = re.compile(r'board_type\[\] PROGMEM = "([^"]+)"')


@dataclass(frozen=True, slots=True)
class Pins:
    """Where a board is wired.

    Attributes
    ----------
    board
        What the board is called.
    gates
        Arduino pin of each gate, from channel 0 on.
    others
        Arduino pin and port of everything else, by its name in `board.h`.
    """

    board: str
    gates: tuple[str, ...]
    others: dict[str, tuple[str, str]]


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
    return Pins(name[1], tuple(channels[1].split()), others)

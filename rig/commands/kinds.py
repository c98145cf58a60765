"""Kinds of values that `rig.command_help` names, as argparse takes them."""

import argparse
import math
import re
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from rig import ready, text_rows, timers
from rig.boards import GATES
from rig.files import check_new, check_place


class _ListFormats(argparse.Action):
    """Print the formats of timers' files that are known, and stop."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        rows = text_rows.read_rows(timers.__file__, "formats.txt")
        print("\n".join(f"{name}: {how}; {example}" for name, how, example in rows))
        parser.exit()


def _accept(
    accepted: str, read: Callable[[str], Any], holds: Callable[[Any], object]
) -> dict[str, Any]:
    """Return a kind of value; text that cannot be read so, or does not hold, is refused."""

    def convert(text: str) -> object:
        with suppress(ValueError):
            value = read(text)
            if holds(value):
                return value
        raise argparse.ArgumentTypeError(f"found '{text}'; accepted: {accepted}")

    return {"type": convert}


def _place(names: str, text: str) -> Path:
    """Read a file's place: in a folder it has the first name, else its ending or another one.

    What ends otherwise is of another kind, such as a protocol that a page would replace.

    Raises
    ------
    InputError
        A file could not be written there.
    """
    name, *others = names.split(",")
    endings, place = (Path(name).suffix, *others), Path(text)
    with suppress(OSError):  # what may not be looked at is told when it is written
        if text.endswith("/") or place.is_dir():
            place /= name
        elif "." not in place.name[1:]:
            place = place if place.exists() else Path(text + endings[0])
        elif not text.endswith(endings):
            raise argparse.ArgumentTypeError(
                f"found '{text}'; accepted endings: {', '.join(endings)}"
            )
    check_place(place)
    return place


def _quantity(dimension: str, text: str) -> float:
    """Read a quantity; units, with fractions and decimals, are loaded only for one."""
    units = import_module("rig.units")
    return float(units.parse(text, units.DIMENSIONS[dimension]).value)


def _socket(name: str) -> Any:
    """Return the socket of the daemon of a rig, by the rig's name."""
    return import_module("rig.daemon.socket_path").default_socket(_NAME["type"](name))


_NAME = _accept("letters, digits, - and _", str, re.compile(r"(?a:[\w-]{1,40})").fullmatch)
"""A rig's name, which becomes a part of a file's."""
KINDS: dict[str, dict[str, Any]] = {
    "int": _accept("a whole number", int, lambda _: True),
    "count": _accept("a whole number, 1 or more", int, lambda n: n >= 1),
    "gates": _accept(
        f"numbers from 0 to {GATES - 1}, with commas between",
        lambda text: sum(1 << channel for channel in set(map(int, text.split(",")))),
        lambda mask: mask < 1 << GATES,
    ),
    "length": _accept(
        "a length above 0, such as 60 mm", partial(_quantity, "LENGTH"), lambda metres: metres > 0.0
    ),
    "name": _NAME,
    "rig": {"dest": "socket", "type": _socket},
    "address": _accept(
        ":8080 for this computer alone, HOST:8080 or 0.0.0.0:8080 for others too",
        lambda text: (text.rpartition(":")[0].strip("[]") or "localhost", int(text.split(":")[-1])),
        lambda address: 0 <= address[1] < 1 << 16,
    ),
    "port": _accept(
        "a device path, or a URL such as sim://, or auto",
        lambda text: import_module("rig.usb.listing").sole_port() if text == "auto" else text,
        bool,
    ),
    "protocol": {"type": ready.find_protocol},
    "text": _accept("words", str, str.strip),
    "seconds": _accept("a time in seconds above 0", float, lambda s: 0.0 < s < math.inf),
    "seed": _accept("a whole number from 0 to 2^63", int, lambda n: 0 <= n < 1 << 63),
    "share": _accept(
        "a share from 0 to 10 %, as in 50 ppm", partial(_quantity, "NUMBER"), lambda x: 0 <= x < 0.1
    ),
    "trials": _accept("a whole number from 2", int, lambda trials: trials >= 2),
    "file": {"type": _place},
    "new": {"type": lambda names, text: check_new(_place(names, text))},
    "path": {"type": lambda text: Path(text) if text else None},
    "formats": {"action": _ListFormats, "nargs": 0},
}

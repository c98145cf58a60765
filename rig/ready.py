"""Where ready files are: in the installed package, or in the project it runs from."""

from __future__ import annotations

from pathlib import Path

from rig.errors import InputError

WIRED = {"pico": "rp2040", "mega": "atmega2560", "uno": "atmega328p"}
"""Boards of whose circuits there is a picture, and its folder in `firmware`."""


def ready_protocol(name: str) -> Path:
    """Find a ready protocol.

    Parameters
    ----------
    name
        Without its ending, such as ``inclined-uniform``.

    Raises
    ------
    InputError
        Where this installation lacks it.
    """
    return _found(f"protocols/{name}.yaml")


def wiring_picture(board: str) -> Path:
    """Find the circuits around a board (SVG), by the word for it at the command line.

    Raises
    ------
    InputError
        Where this installation lacks it.
    """
    return _found(f"firmware/{WIRED[board]}/wiring.svg")


def _found(name: str) -> Path:
    here = Path(__file__).parent
    path = next((path for folder in (here, here.parent) if (path := folder / name).is_file()), None)
    if path is None:
        raise InputError(f"this installation has no {name}", "install chainrig again")
    return path

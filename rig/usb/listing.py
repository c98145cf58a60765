"""The serial ports of this computer, and why each may or may not be a board's. Opens none."""

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from rig.boards import MEGA, PICO, UNO
from rig.reasons import rig_error

if TYPE_CHECKING:
    from serial.tools.list_ports_common import ListPortInfo


class Known(NamedTuple):
    """A kind of USB device; several kinds may have the same numbers.

    Attributes
    ----------
    name
        What it is.
    numbers
        USB vendor and product in hexadecimal, as often as it has others.
    product
        Of a board: what the text of its product begins with, where other devices have the numbers
        too. `None` for a chip: that is on cheap copies of boards and on other instruments, so it
        says only that there may be a board.
    """

    name: str
    numbers: str
    product: str | None = None


# Boards: as in boards.txt of the makers' own Arduino AVR package, 1.8; the Pico's is what its maker
# gives any serial port on it. Chips: their makers'.
_MEGAS = "2341:0010 2341:0042 2341:0210 2341:0242 2a03:0010 2a03:0042"
KNOWN = (
    Known(PICO.name, "2e8a:000a", "chainrig"),
    Known(MEGA.name, _MEGAS, ""),
    Known(UNO.name, "2341:0001 2341:0043 2341:0243 2a03:0043", ""),
    Known("CH341", "1a86:5523"),
    Known("CH340", "1a86:7523"),
    Known("FTDI FT232R", "0403:6001"),
    Known("FTDI FT231X", "0403:6015"),
)


class SerialPort(NamedTuple):
    """A serial port.

    Attributes
    ----------
    path
        Device path.
    vid, pid, serial_number, manufacturer, product
        What USB says of it; `None` where it says nothing.
    kinds
        What the numbers may stand for, empty when nobody knows.
    skipped
        Why it is no candidate; empty for a candidate.
    """

    path: str
    vid: int | None = None
    pid: int | None = None
    serial_number: str | None = None
    manufacturer: str | None = None
    product: str | None = None
    kinds: tuple[str, ...] = ()
    skipped: str = ""

    @property
    def kind(self) -> str:
        """All that the numbers may stand for."""
        return " or ".join(self.kinds)

    @property
    def candidate(self) -> bool:
        """Whether it is a board's port, by its numbers."""
        return not self.skipped


def serial_ports() -> list[SerialPort]:
    """List what is there, candidates first."""
    # Imported when it is used: it looks through /sys, and few commands want that.
    from serial.tools.list_ports import comports  # noqa: PLC0415

    ports = map(_describe, comports())
    return sorted(ports, key=lambda port: (not port.candidate, port.path))


def _describe(info: "ListPortInfo") -> SerialPort:
    """Say what a port is and whether it may be a board's."""
    numbers = f"{info.vid or 0:04x}:{info.pid or 0:04x}"
    kinds = [kind for kind in KNOWN if numbers in kind.numbers]
    boards = tuple(kind.product for kind in kinds if kind.product is not None)
    is_foreign = not (info.product or "").startswith(boards)
    reasons = {
        "no USB device": None in {info.vid, info.pid},
        "no board's USB numbers: name it with --port if it is one": not kinds,
        "a chip that boards and other instruments have: name it with --port": not boards,
        "a board with another program: name it with --port if it is one of this rig": is_foreign,
    }
    skipped = next((reason for reason, applies in reasons.items() if applies), "")
    texts = info.serial_number, info.manufacturer, info.product
    names = tuple(kind.name for kind in kinds)
    return SerialPort(info.device, info.vid, info.pid, *texts, names, skipped)


def sole_port() -> str:
    """Return the path of the only board there is.

    Raises
    ------
    DeviceError
        There is none, or there are several.
    """
    paths = [port.path for port in serial_ports() if port.candidate]
    if len(paths) != 1:
        code = "many_boards" if paths else "no_board"
        raise rig_error(code, ports=" and ".join(paths))
    return paths[0]


def path_of(serial_number: str, ports: Iterable[SerialPort]) -> str | None:
    """Find a board again among some ports, wherever it is plugged in; `None` while it is not there.

    Raises
    ------
    DeviceError
        Several have this number, as some copies of boards do.
    """
    paths = [port.path for port in ports if port.serial_number == serial_number]
    if len(paths) > 1:
        raise rig_error("many_serial_numbers", ports=" and ".join(paths), number=serial_number)
    return paths[0] if paths else None


def serial_number_at(path: str, ports: Iterable[SerialPort] | None = None) -> str | None:
    """Give the USB serial number of what is plugged in at a port.

    Parameters
    ----------
    path
        Device path, or a link to one as in ``/dev/serial/by-id``.
    ports
        Where to look; by default at everything that is there.

    Returns
    -------
    str or None
        `None` for URLs, where nothing is plugged in, and of a chip without one, such as a CH340.
    """
    place, listed = os.path.realpath(path), serial_ports() if ports is None else ports
    here = (port.serial_number for port in listed if os.path.realpath(port.path) == place)
    return next(here, None)

"""Opening a port by name or URL: ``/dev/ttyACM0``, ``sim://``, ``socket://HOST:PORT``."""

import errno
import socket
import warnings
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import urlsplit

import serial
from serial.urlhandler import protocol_socket

from rig.clock.host import Clock, SystemClock
from rig.errors import RigError
from rig.ports import check_name
from rig.reasons import errors_become, rig_error

BAUDRATE = 500_000
"""Exact from 16 MHz (UBRR 3 with U2X); 115200 would be 2.1 % off."""
READ_TIMEOUT_S = 0.02
_CODES = dict.fromkeys((errno.ENOENT, errno.ENODEV), "no_port")
_CODES |= dict.fromkeys((errno.EACCES, errno.EPERM), "port_denied")
_CODES |= dict.fromkeys((errno.EBUSY, errno.EAGAIN), "port_taken")
_PLAIN = {errno.ENOTTY: "it is no serial port", errno.EISDIR: "it is a folder"}
_PEEK = 1 << 16  # bytes; more than a session reads at once
_NETWORK = ("socket", "rfc2217")  # URL schemes of ports at another computer


Port: TypeAlias = serial.Serial
"""What pyserial makes of any URL; its rate in bit/s counts only on a UART."""


def open_port(url: str) -> Port:
    """Open a port for this program alone.

    Parameters
    ----------
    url
        A device path or a pyserial URL.

    Returns
    -------
    Port
        The open pyserial port, with a short read time-out.

    Raises
    ------
    DeviceError
        When it cannot be opened; the hint says what to try.
    InputError
        A simulation's URL says what it does not know.
    """
    check_name(url)
    _add_handlers()
    scheme = urlsplit(url).scheme if "://" in url else ""
    try:
        with warnings.catch_warnings():
            # Pyserial 3.5 starts its RFC 2217 reader in a way Python has given up since.
            warnings.filterwarnings("ignore", r"set(Daemon|Name)\(\)", DeprecationWarning)
            opener: Any = NetworkPort if scheme == "socket" else serial.serial_for_url
            port: Port = opener(url, baudrate=BAUDRATE, timeout=READ_TIMEOUT_S, exclusive=True)
            return port
    except RigError:
        raise  # a simulated port knows better what is wrong
    except OSError as error:  # SerialException is one
        if scheme in _NETWORK:
            # Pyserial keeps the cause only behind its own words.
            cause = error.__context__ if isinstance(error.__context__, OSError) else error
            raise rig_error("port_unreachable", port=url, text=cause) from error
        below = error.__context__.args[:1] if error.__context__ else ()
        number = error.errno or next((code for code in below if isinstance(code, int)), 0)
        code, text = _CODES.get(number, "port_failed"), _PLAIN.get(number, str(error))
        raise rig_error(code, port=url, text=text) from error
    except ValueError as error:
        # Pyserial says no more of a handler it cannot import.
        code = "emulator_missing" if scheme == "emu" else "port_failed"
        raise rig_error(code, port=url, text=error) from error


def check_url(url: str) -> None:
    """See that a port's name is one that could ever be opened; opens nothing.

    Raises
    ------
    InputError
        No such kind of URL, or a simulation's with a name or a setting that means nothing.
    """
    check_name(url)
    _add_handlers()
    with errors_become("not_a_port", ValueError, port=url):
        port = serial.serial_for_url(url, do_not_open=True)
    if hasattr(port, "check_settings"):  # a simulation's
        port.check_settings()


def _add_handlers() -> None:
    # Of sim:// and emu://; an installed simulation must not take the name ``sim``.
    is_installed = (Path(__file__).parents[2] / "rig_sim").is_dir()
    for package in ("rig_sim" if is_installed else "sim", "rig_emulator"):
        if package not in serial.protocol_handler_packages:
            serial.protocol_handler_packages.append(package)


def port_clock(port: object) -> Clock:
    """Find the clock that goes with a port.

    Parameters
    ----------
    port
        An open port.

    Returns
    -------
    Clock
        The port's own (a simulated port lives in virtual time), else the computer's.
    """
    clock: Clock | None = getattr(port, "clock", None)
    return SystemClock() if clock is None else clock


class NetworkPort(protocol_socket.Serial):
    """A ``socket://`` port that says how much has really arrived.

    Pyserial's own says 1 when anything has: everything would be read byte by byte, each a record
    of its own in the session.
    """

    _socket: Any  # pyserial's, which its types do not name

    def close(self) -> None:
        """Hang up."""
        line = self._socket
        super().close()
        if line is not None:
            line.close()  # pyserial forgets to, where the other end has hung up already

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read at once."""
        if not super().in_waiting:  # also says when the port is closed
            return 0
        return len(self._socket.recv(_PEEK, socket.MSG_PEEK))

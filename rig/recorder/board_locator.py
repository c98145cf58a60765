"""Where a board is now: found again by its serial number, and never taken for another one."""

from pathlib import Path

from rig.link.messages import Identity
from rig.reasons import rig_error
from rig.usb.listing import path_of, serial_number_at, serial_ports

SERIAL_NUMBER = "usb_serial_number"
"""In a session's record of who was there."""


class BoardLocator:
    """The port that was named, and the board that was met there.

    Parameters
    ----------
    url
        The port, as the user named it.

    Attributes
    ----------
    path
        Where the board is: the port's name until the board comes back at another one.
    serial_number
        Its USB serial number; `None` while unknown, of boards without one and of URLs.
    bound
        Whether it must be this board: a session's clock and held drop are one board's.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self.path = url
        self.serial_number: str | None = None
        self.bound = False
        self._unique_id: bytes | None = None

    def look(self) -> str:
        """Find where the board is now.

        Returns
        -------
        str
            What to open; the name that was given when the board is nowhere to be seen.

        Raises
        ------
        DeviceError
            Another board is at the port that was named, or several have this serial number.
        """
        self.path, number = self.url, self.serial_number
        ports = serial_ports() if number else []
        present = serial_number_at(self.url, ports)
        if number is None or number == present:
            return self.path
        if (path := path_of(number, ports)) is not None:
            self.path = path
        elif present is not None and self.bound:
            text = f"serial number {present}, not {number}"
            raise rig_error("other_board", port=self.url, difference=text)
        return self.path

    def seek(self, serial_number: str | None) -> None:
        """Look for a board that was met in another life, unless something is where the user said.

        Parameters
        ----------
        serial_number
            The board's, as far as it is known.
        """
        if self._unique_id is None and "://" not in self.url and not Path(self.url).exists():
            self.serial_number = serial_number

    def meet(self, identity: Identity) -> dict[str, str]:
        """Take note of who answers at `path`.

        Returns
        -------
        dict
            What else is known of it, for the record.

        Raises
        ------
        DeviceError
            It is not the board that it must be.
        """
        if self.bound and self._unique_id not in {None, identity.unique_id}:
            text = f"id {identity.unique_id.hex()}, not {(self._unique_id or b'').hex()}"
            raise rig_error("other_board", port=self.path, difference=text)
        self._unique_id = identity.unique_id
        if "://" not in self.path:
            self.serial_number = serial_number_at(self.path)
        return {} if self.serial_number is None else {SERIAL_NUMBER: self.serial_number}

"""``sim://``: falling chains behind a virtual microcontroller, as a pyserial port.

``sim://?protocol=FILE&seed=N&truth=FILE&pace=1&<dial>=<value>…``, for example
``sim://?protocol=protocols/inclined-uniform.yaml&seed=3&missed=2%25&skew_sd=4ms``. ``quiet=1``
switches all disturbances off. The truth file gets one line of JSON a drop.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from rig.errors import InputError
from rig.protocol import reader
from sim.board import VirtualBoard
from sim.clock import VirtualClock
from sim.dials import read_dials
from sim.lab import ChainLab
from sim.serial_port import SimulatedSerial
from sim.truth import append_truth

if TYPE_CHECKING:
    from sim.truth import Truth


class Serial(SimulatedSerial):
    """The port that pyserial opens for a ``sim://`` URL."""

    def make_board(self) -> VirtualBoard:
        """Hang the chains of the protocol that the URL names."""
        settings: dict[str, str] = {}
        for name, text in parse_qsl(urlsplit(str(self.port)).query, keep_blank_values=True):
            if name in settings:
                raise InputError(f"sim://: {name} is given twice")
            settings[name] = text
        source = settings.pop("protocol", "")
        if not source:
            raise InputError(
                "sim:// needs a scene to simulate", "name one: sim://?protocol=FILE.yaml"
            )
        seed = _number(settings.pop("seed", "0"), "seed")
        pace = _number(settings.pop("pace", "0"), "pace")
        truth = settings.pop("truth", "")
        dials = read_dials(settings)
        if truth:
            _check_writable(Path(truth))
        self.clock = VirtualClock(pace)
        self.disturb(seed, jitter_s=dials.latency, corrupt=dials.corrupt, lose=dials.lose)

        def tell(what: Truth) -> None:
            if truth:
                append_truth(Path(truth), what)

        lab = ChainLab(reader.read(source), dials, seed, tell)
        return VirtualBoard(lab, seed, ppm=dials.clock * 1e6, baudrate=self.baudrate)


def _check_writable(path: Path) -> None:
    """Find out now: in the middle of a drop the fault would look like a broken cable."""
    try:
        path.open("a", encoding="utf-8").close()
    except OSError as error:
        raise InputError(f"sim://: truth: cannot write {path}: {error.strerror}") from None


def _number(text: str, name: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(f"sim://: {name}: {text!r} is not a whole number") from None

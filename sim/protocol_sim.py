"""``sim://``: falling chains behind a virtual microcontroller, as a pyserial port.

``sim://?protocol=FILE&seed=N&truth=FILE&pace=1&<dial>=<value>…``, for example
``sim://?protocol=protocols/inclined-uniform.yaml&seed=3&missed=2%25&skew_sd=4ms``. ``quiet=1``
switches all disturbances off. The truth file gets one line of JSON a drop. With
``dynamics=resolved`` chains fall in the resolved world. ``series=1`` has other drops fall on the
rig of a seed.
"""

from __future__ import annotations

from rig.ports import read_settings

from .board import VirtualBoard
from .clock import VirtualClock
from .scene import read_disturbances, set_scene
from .serial_port import SimulatedSerial


class Serial(SimulatedSerial):
    """The port that pyserial opens for a ``sim://`` URL."""

    def check_settings(self) -> None:
        """See that the URL's settings, but for files, mean something."""
        read_disturbances("sim", read_settings(str(self.port)))

    def make_board(self) -> VirtualBoard:
        """Hang the chains of the protocol that the URL names."""
        scene = set_scene("sim", read_settings(str(self.port)))
        self.clock = VirtualClock(scene.pace)
        self.disturb(scene.seed, scene.dials)
        dials = scene.dials
        board = VirtualBoard(
            scene.lab,
            scene.seed,
            ppm=dials.clock * 1e6,
            drift_ppm=dials.drift * 1e6,
            wander_ppm=dials.wander * 1e6,
            baudrate=self.baudrate,
        )
        if (second_ns := scene.second_ns()) is not None:
            board.reference([second_ns], second_ns)
        return board

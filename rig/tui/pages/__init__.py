"""The pages: each makes of what is known, and of what is looked at, what there is to see."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.tui.pages import device, drop, home, session

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.tui.desk import Desk, Face
    from rig.tui.model import Model

FACES: Mapping[str, Callable[[Model, Desk, int], Face]] = {
    "protocol": home.face,
    "device": device.face,
    "run": drop.face,
    "result": drop.face,
    "session": session.face,
    "history": drop.face,
}
"""A function a page; the last argument is how many columns its tables have."""

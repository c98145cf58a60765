"""Which key does what, where: STOP first, then whatever is open, then the table of actions."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

from textual.widgets import Input

from rig.campaign.events import Stopped
from rig.campaign.machine import BEFORE_RELEASE
from rig.tui.screens.ask import Ask, Confirm, Pick
from rig.tui.screens.help import Help

if TYPE_CHECKING:
    from rig.tui.app import RigApp

_REPEAT_S = 0.7
"""A key that is held down repeats itself: that is no wish to stop."""


def takes(app: RigApp, key: str) -> bool:
    """Do what a key means now; say whether it meant anything."""
    name, screen = app.action_of.get(key), app.screen
    if name == "stop" or (key == "escape" and not isinstance(app.focused, Input)):
        app.action_do("stop")
        if isinstance(screen, (Help, Confirm, Pick)):
            screen.dismiss(None)
        return True
    if app.flow.stage in BEFORE_RELEASE:
        held = name == "go_on" and monotonic() - app.since < _REPEAT_S
        if not held:
            app.event(Stopped())
        return True
    if isinstance(screen, Ask) and key == "escape":
        screen.dismiss(None)
        return True
    if isinstance(screen, Pick) and key == "backspace":
        screen.dismiss(None)
        return True
    if isinstance(screen, Confirm):
        screen.dismiss(key == "enter")
        return True
    if isinstance(screen, Help):
        if name in {"previous", "next"}:
            screen.move(1 if name == "next" else -1)
        else:
            screen.dismiss(None)
        return True
    if len(app.screen_stack) > 1 or name is None:
        return False
    app.action_do(name)
    return True

"""How a plan that is carried out is told: a picture that grows on a terminal, or lines."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

from rig.commands.output import say
from rig.protocol import reader
from rig.runner import Operator


def narrator(source: str, ask: Callable[[str], None] | None) -> Operator:
    """Narrate by a picture where it can be drawn and there is one, or else by lines.

    Parameters
    ----------
    source
        The protocol file.
    ask
        How lines ask for what is to be hung; `None` where nobody is there.
    """
    draws = sys.stderr.isatty() and sys.stderr.encoding.lower() == "utf-8"
    draws = draws and os.environ.get("TERM") != "dumb"
    protocol = reader.read(source) if draws else None
    if protocol is None or protocol.surface is None or protocol.blind:
        return Operator(say, ask)
    from rig.commands.growing import Growing  # noqa: PLC0415 - only where somebody looks

    screen = Growing(protocol, sys.stderr)
    return Operator(screen.say, screen.ask if ask else None, screen.show_result)

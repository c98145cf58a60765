"""``rig flash``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.commands.output import say
from rig.flash.steps import flash

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Flash a board and say what it is now."""
    found = flash(arguments.board, arguments.port, arguments.hex, arguments.avrdude, say)
    print(
        f"{found.board}, {found.firmware}, {found.gates} gates, "
        f"id {found.unique_id.hex()}: flashed and verified"
    )
    return 0

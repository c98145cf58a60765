"""``rig recover``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.commands.output import say
from rig.errors import SessionError
from rig.recover.examine import describe, examine
from rig.recover.save import save

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Say what is whole; save it where that is wanted."""
    found = examine(arguments.session)
    print("\n".join(describe(found)))
    if arguments.output is None:
        if not found.whole and not found.foreign:
            say("rig recover SESSION -o NEW saves it")
        return 0 if found.whole else SessionError.exit_code
    missing = save(found, arguments.output, arguments.protocol)
    for what in missing:
        say(f"not saved: {what}")
    say(f"{arguments.output}: {len(found.drops)} drops; rig analyze computes their results")
    return 0

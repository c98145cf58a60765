"""``rig recover``."""

from rig.commands.output import Arguments, say
from rig.errors import SessionError
from rig.recover.examine import describe, examine
from rig.recover.save import save


def main(arguments: Arguments) -> int:
    """Say what is whole; save it where that is wanted."""
    damage = examine(arguments.session)
    print("\n".join(describe(damage)))
    if arguments.output is None:
        if not damage.whole and not damage.foreign:
            say("rig recover SESSION -o NEW saves it")
        return 0 if damage.whole else SessionError.exit_code
    for record in save(damage, arguments.output, arguments.protocol):
        say(f"not saved: {record}")
    say(f"{arguments.output}: {len(damage.drops)} drops; rig analyze computes their results")
    return 0

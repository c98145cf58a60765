"""``rig replay``."""

from rig.commands.output import Arguments, progress
from rig.replay import replay
from rig.session.store import Session

DIFFERENT = 1


def main(arguments: Arguments) -> int:
    """Replay a session and say whether everything comes out the same."""
    with Session.open(arguments.session, readonly=True) as session:
        outcome = replay(session, progress)
    print("\n".join(outcome.lines))
    return DIFFERENT if outcome.differences else 0

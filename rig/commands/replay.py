"""``rig replay``."""

from argparse import Namespace

from rig.commands.output import progress
from rig.replay import replay
from rig.session.store import Session

DIFFERENT = 1


def main(arguments: Namespace) -> int:
    """Replay a session and say whether everything comes out the same."""
    with Session.open(arguments.session, readonly=True) as session:
        outcome = replay(session, progress)
    print("\n".join(outcome.lines))
    return DIFFERENT if outcome.differences else 0

"""``rig unblind``."""

from rig.commands.output import Arguments
from rig.reasons import rig_error
from rig.results import kept_back, protocol_of
from rig.session.store import Session


def main(arguments: Arguments) -> None:
    """Record that a blind session's numbers may be seen from now on."""
    with Session.open(arguments.session) as session:
        if not kept_back(session, protocol_of(session)):
            when = f"since {session.unblinded}" if session.unblinded else "and never was blind"
            raise rig_error("session_open", path=arguments.session, when=when)
        session.unblind()
        print(f"unblinded at {session.unblinded}; results: rig analyze {arguments.session}")

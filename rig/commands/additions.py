"""What is added to a session by hand: notes, files, and that its results may be seen."""

from pathlib import Path

from rig.commands.output import Arguments
from rig.files import read_input
from rig.reasons import NOTE, errors_become, plain_reason, rig_error
from rig.report.numbers import ranges
from rig.session.store import Session

LARGEST = 1 << 25
"""Bytes of a file; half of what a value of a session file may have."""


def add_note(arguments: Arguments) -> None:
    """Add a note to a recorded run; its verdict stays."""
    with Session.open(arguments.session) as session:
        last = session.latest_state(arguments.run)
        if last is None or session.drop(last.run, last.attempt) is None:
            runs = ranges("run", [drop.run for drop in session.latest_drops()])
            raise rig_error("run_unrecorded", path=arguments.session, run=arguments.run, runs=runs)
        reasons = (*last.reasons, plain_reason(arguments.text, NOTE))
        # The host's clock may have begun anew since the drop: the entry keeps the drop's time.
        session.add_state(last.run, last.attempt, last.state, last.host_ns, reasons)
    print(f"noted to run {last.run}, attempt {last.attempt}: {arguments.text}")


def attach(arguments: Arguments) -> None:
    """Add a file to a session, for its report."""
    path = arguments.file
    with errors_become("attachment_unreadable", OSError, path=path):
        data = read_input(path, LARGEST + 1)
    if not 0 < len(data) <= LARGEST:
        raise rig_error("attachment_size", path=path)
    with Session.open(arguments.session) as session:
        session.attach(Path(path).name, data)
    print(f"attached to {arguments.session}: {path}, {len(data)} bytes")


def unblind(arguments: Arguments) -> None:
    """Record that a blind session's numbers may be seen from now on."""
    from rig.results.whole import kept_back  # noqa: PLC0415 - notes and files need no numpy

    with Session.open(arguments.session) as session:
        if not kept_back(session):
            when = f"since {session.unblinded}" if session.unblinded else "and never was blind"
            raise rig_error("session_open", path=arguments.session, when=when)
        session.unblind()
        print(f"unblinded at {session.unblinded}; results: rig analyze {arguments.session}")

"""``rig analyze``."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rig import __version__
from rig.commands.output import print_results, progress
from rig.errors import SessionError
from rig.results import results
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.session.reading import Reader


def main(arguments: Namespace) -> int:
    """Compute the results of a session and keep them in it."""
    if arguments.budget is not None:
        from rig.commands import budget  # noqa: PLC0415 - only when it is asked for

        return budget.main(arguments)
    with Session.open(arguments.session, readonly=True) as session:
        extent = _extent(session)
        found = results(session, progress("analysing run"))
    # A session that is being written, or on a read-only disk, is analysed all the same.
    with suppress(SessionError), Session.open(arguments.session) as session:
        if _extent(session) == extent:  # else it went on meanwhile, and these are out of date
            session.put_results([*found["runs"], *found.get("superseded", [])], __version__)
    return print_results(found, as_json=arguments.json)


def _extent(session: Reader) -> tuple[int, int]:
    """How far a session has come: its records are only ever added to."""
    return len(session.states()), len(session.pings())

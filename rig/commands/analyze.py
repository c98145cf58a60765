"""``rig analyze``."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rig import __version__
from rig.commands.output import print_results, progress
from rig.errors import SessionError
from rig.report.columns import aligned
from rig.report.parts import effects_parts, scatter_part
from rig.results import with_analysis
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
        found, analysis = with_analysis(session, progress("analysing run"))
    if arguments.session_trials is not None:
        from rig.commands.trials import session_trials  # noqa: PLC0415 - likewise

        found["monte_carlo"] = session_trials(analysis, arguments.session_trials)
    # A session that is being written, or on a read-only disk, is analysed all the same.
    with suppress(SessionError), Session.open(arguments.session) as session:
        if _extent(session) == extent:  # else it went on meanwhile, and these are out of date
            session.put_results([*found["runs"], *found.get("superseded", [])], __version__)
    code = print_results(found, as_json=arguments.json)
    if not arguments.json:
        more = [scatter_part(found)] if arguments.scatter else []
        for part in (*more, *effects_parts(found)):
            print("\n".join(["", part.heading, *aligned(part.columns, part.records)]))
        if "monte_carlo" in found:
            from rig.commands.trials import trials_lines  # noqa: PLC0415 - likewise

            print("\n".join(["", *trials_lines(found["monte_carlo"])]))
    return code


def _extent(session: Reader) -> tuple[int, int]:
    """How far a session has come: its records are only ever added to."""
    return len(session.states()), len(session.pings())

"""``rig analyze``."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rig.commands.output import print_results, progress, show
from rig.errors import SessionError
from rig.report.columns import aligned
from rig.report.parts import effects_parts, gate_parts, prior_part, scatter_part
from rig.results import keep, results
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.analysis.identified import Identified
    from rig.records import Job


def main(arguments: Namespace) -> int:
    """Compute the results of a session and keep them in it."""
    if arguments.budget is not None:
        from rig.commands import budget  # noqa: PLC0415 - only when it is asked for

        return budget.main(arguments)
    with Session.open(arguments.session, readonly=True) as session:
        extent = session.extent()
        known: dict[Job, Identified] = {}
        found = results(session, progress("analysing run"), known)
    more: dict[str, Any] = {}
    if arguments.session_trials is not None:
        from rig.commands.budget import session_trials  # noqa: PLC0415 - likewise

        more["monte_carlo"] = session_trials(found.analysis, arguments.session_trials)
    if arguments.priors:
        from rig.analysis.sensitivity import prior_sensitivity  # noqa: PLC0415 - likewise

        more["prior_sensitivity"] = prior_sensitivity(found.analysis)
    # A session that is being written, or on a read-only disk, is analysed all the same.
    with suppress(SessionError), Session.open(arguments.session) as session:
        if session.extent() == extent:  # else it went on meanwhile, and these are out of date
            keep(session, found, known)
    code = print_results(found, as_json=arguments.json, more=more)
    if not arguments.json:
        asked = [scatter_part(found.analysis.summary)] if arguments.scatter else []
        asked += [prior_part(more["prior_sensitivity"])] if arguments.priors else []
        asked += [*gate_parts(found.analysis.summary), *effects_parts(found.analysis.effects)]
        for part in asked:
            show(["", part.heading, *aligned(part.columns, part.records)])
        if "monte_carlo" in more:
            from rig.commands.budget import trials_lines  # noqa: PLC0415 - likewise

            show(["", *trials_lines(more["monte_carlo"])])
    return code

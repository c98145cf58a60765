"""Select drops of a session by words such as a verdict, an incline or a chain."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.analysis.result import GOOD
from rig.records import Job
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from rig.protocol.protocol import Run
    from rig.results.live import SessionView


def condition(run: Run) -> str:
    """Name what a run drops and, where it strikes, at which incline."""
    if run.impact is None:
        return plain(run.free, 20)
    return f"{run.incline_deg:g}° impact {plain(run.impact, 20)}"


def chosen(view: SessionView, words: str) -> tuple[Job, ...]:
    """List the drops that all words fit, in order of recording.

    Parameters
    ----------
    words
        Of `labels`, separated by blanks; empty for every drop.
    """
    words_wanted = {word.casefold().rstrip("°") for word in words.split()}
    return tuple(job for job, drop_labels in labels(view).items() if words_wanted <= {*drop_labels})


def labels(view: SessionView) -> dict[Job, tuple[str, ...]]:
    """Label every drop: incline and chain where it strikes, verdict, and whether it counts."""
    counting = {
        Job(drop.run.number, drop.attempt) for drop in view.analysis.runs if drop.verdict in GOOD
    }
    drops = {}
    for job in view.jobs:
        run = view.plan[job.run]
        struck = (f"{run.incline_deg:g}", run.impact.casefold()) if run.impact else ()
        counts = ("counts",) if job in counting else ()
        drops[job] = (*struck, view.results[job].verdict, *counts)
    return drops

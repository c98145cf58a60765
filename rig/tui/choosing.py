"""Which drops of a session are looked at: words that say incline, chain or verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.analysis.result import GOOD
from rig.records import Job

if TYPE_CHECKING:
    from rig.results.live import SessionView

HOW = "Which drops? An incline, a chain or a verdict, or several of these: 40 A accepted"


def chosen(view: SessionView, words: str) -> tuple[Job, ...]:
    """List the drops that all words fit, in order of recording.

    Parameters
    ----------
    words
        Inclines in degrees, names of striking chains, verdicts, or ``counts``, separated by
        blanks; empty for every drop.
    """
    counting = {
        Job(one.run.number, one.attempt) for one in view.analysis.runs if one.verdict in GOOD
    }
    wanted = [word.casefold().rstrip("°") for word in words.split()]
    return tuple(
        job for job in view.jobs if set(wanted) <= _words_of(view, job, counts=job in counting)
    )


def _words_of(view: SessionView, job: Job, *, counts: bool) -> set[str]:
    run = view.plan[job.run]
    chain = run.impact or run.free or ""
    found = {f"{run.incline_deg:g}", chain.casefold(), view.results[job].verdict}
    return found | ({"counts"} if counts else set())

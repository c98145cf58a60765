"""What `rig estimate` and a report say of the impacts: kept, or estimated now."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.cache.entry import recall
from rig.estimate.session import SessionEstimate, estimate
from rig.results.whole import complete_analysis, protocol_of

if TYPE_CHECKING:
    from rig.analysis.session import Progress
    from rig.results.whole import SessionResults
    from rig.session.reading import Reader


def session_estimate(
    session: Reader,
    results: SessionResults,
    progress: Progress | None = None,
    *,
    fresh: bool = False,
) -> SessionEstimate:
    """Return what the impacts of a session have in common, kept or estimated now.

    Parameters
    ----------
    results
        Of `results`, with its joint fit where that was made.
    progress, fresh
        As there.

    Raises
    ------
    InputError, SessionError
        As `rig.estimate.session.estimate` raises it; the session is blind.
    """
    return recall(
        SessionEstimate,
        lambda: estimate(protocol_of(session), complete_analysis(session, results, progress)),
        results.digest,
        fresh=fresh,
    )

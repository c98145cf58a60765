"""Impact parameters for `rig estimate` and reports, from the cache or estimated anew."""

from rig.analysis.session import Progress
from rig.cache.entry import recall
from rig.estimate.session import SessionEstimate, estimate
from rig.results.whole import SessionResults, complete_analysis, protocol_of
from rig.session.reading import Reader


def session_estimate(
    session: Reader,
    results: SessionResults,
    progress: Progress | None = None,
    *,
    fresh: bool = False,
) -> SessionEstimate:
    """Return the impact parameters of a session, from the cache or estimated anew.

    Parameters
    ----------
    results
        Results of the session, with the joint fit if it was made.
    progress, fresh
        As for `rig.results.whole.results`.

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

"""``rig analyze --session-trials``: the session's joint adjustment by Monte Carlo."""

from __future__ import annotations

from statistics import fmean
from typing import TYPE_CHECKING, Any

from rig.analysis.monte_carlo import agreement, session_monte_carlo
from rig.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rig.analysis.session import Analysis

SEED = 1


def session_trials(analysis: Analysis, trials: int) -> dict[str, Any]:
    """Propagate distributions through a session, beside its budgets (JCGM 101).

    Parameters
    ----------
    trials
        M, at least 2.

    Returns
    -------
    dict
        ``{"trials", "seed", "runs": [{"run", "attempt", "quantities": {name: {"mean", "u", "low",
        "high", "d_low", "d_high", "tolerance", "agrees", "u_ratio"}}}]}``; `u_ratio` is the trials'
        u over the budget's.

    Raises
    ------
    InputError
        The session has no joint fit, or fewer than two trials are asked for.
    """
    if analysis.joint is None:
        raise InputError(
            "this session has too few good runs to be adjusted together",
            "rig analyze SESSION --budget RUN propagates one run by itself",
        )
    if trials < 2:
        raise InputError(f"{trials} trials tell no uncertainty", "ask for a hundred or more")
    results = {
        (result.run.number, result.attempt): result
        for result in (*analysis.runs, *analysis.superseded)
    }
    drawn = session_monte_carlo(analysis.joint, trials, SEED)
    runs = []
    for key, one in zip(analysis.adjusted, drawn, strict=True):
        quantities = {}
        for name, measured in results[key].quantities.items():
            agreed = agreement(measured.value, measured.u, one[name], trials)
            quantities[name] = one[name].json() | agreed.json()
            quantities[name]["u_ratio"] = one[name].u / measured.u
        runs.append({"run": key[0], "attempt": key[1], "quantities": quantities})
    return {"trials": trials, "seed": SEED, "runs": runs}


def trials_lines(found: Mapping[str, Any]) -> Iterator[str]:
    """Say in words how far both ways agree."""
    yield (
        f"Monte Carlo of the whole session: {found['trials']} trials, seed {found['seed']}; 95 % "
        "intervals beside value ± 1.96 u (JCGM 101, clause 8)"
    )
    names = found["runs"][0]["quantities"]
    for name in names:
        ones = [run["quantities"][name] for run in found["runs"]]
        agree = sum(one["agrees"] for one in ones)
        ratio = fmean(one["u_ratio"] for one in ones)
        yield f"  {name:<18} u by trials / u by budget {ratio:.3f}, {agree} of {len(ones)} agree"

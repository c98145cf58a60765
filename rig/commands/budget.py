"""``rig analyze --budget``, and ``--session-trials``: what uncertainties are made of."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rig.analysis import monte_carlo
from rig.analysis.distributions import coverage_factor
from rig.analysis.drop import DropCase
from rig.analysis.session import Analysis, planned_run
from rig.cache.entry import recall
from rig.commands.output import print_data, tell_damage
from rig.errors import InputError
from rig.protocol.plan import runs
from rig.reasons import sentences
from rig.report.numbers import decimals_for, fixed
from rig.report.templates import sentence
from rig.results import SessionResults, calibration, check_open, protocol_of, results
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.analysis.monte_carlo import Propagated
    from rig.analysis.result import Measured
    from rig.measurands import Measurand
    from rig.session.reading import Reader

SEED = 1
_LEAST = 0.001  # in the finer unit: less is none


def main(arguments: Namespace) -> int:
    """Print a run's budget in the session's light, and by itself beside Monte Carlo trials."""
    with Session.open(arguments.session, readonly=True) as session:
        asked, fresh = (arguments.budget, arguments.trials, SEED), arguments.fresh
        outcome = results(session, fresh=fresh)
        make = partial(budget, session, outcome, *asked)
        account = recall(dict, make, "budget", outcome.digest, asked, fresh=fresh)
    words = sentence("budget", account, _in_fine).split("\n")
    print_data(account, words, as_json=arguments.json)
    return tell_damage(outcome.analysis)


def budget(
    session: Reader, outcome: SessionResults, number: int, trials: int | str | None, seed: int
) -> dict[str, Any]:
    """Account for the uncertainty of a run's results, beside the analysis of all.

    Parameters
    ----------
    whole
        Results of the session.
    number
        Of the run.
    trials, seed
        Of the Monte Carlo propagation, JCGM 101: so many; ``adaptive``, as many as u to one digit
        needs; or, if not given, as many as tell whether it agrees, within bounds.

    Raises
    ------
    InputError
        A run that was not recorded, or is void.
    """
    drop = next(iter(session.latest_drops(number)), None)
    if drop is None:
        raise InputError(f"run {number} has no drop in this session")
    protocol = protocol_of(session)
    check_open(session, protocol)
    planned = planned_run({run.number: run for run in runs(protocol)}, drop)
    single, fit = DropCase(protocol, planned, drop, calibration(session).scale(drop)).read()
    if fit is None:
        raise InputError(f"run {number} is void: {sentences(single.reasons)}")
    result = next(result for result in outcome.analysis.runs if result.run.number == number)
    if trials is None:
        samples, count = monte_carlo.until_decided(fit, single.quantities, seed)
    elif isinstance(trials, str):
        samples, count = monte_carlo.adaptive(fit, seed)
    else:
        samples, count = monte_carlo.monte_carlo(fit, trials, seed), trials
    return {
        "run": number,
        "learned": result.learned,
        "budget": {name: _lines(value) for name, value in result.quantities.items()},
        "by_itself": {name: _lines(value) for name, value in single.quantities.items()},
        "monte_carlo": {
            "trials": count,
            "seed": seed,
            "quantities": {
                name: _compare_trials(single.quantities[name], sample, count)
                for name, sample in samples.items()
            },
        },
    }


def _compare_trials(measured: Measured, sample: Propagated, trials: int) -> dict[str, Any]:
    """Write what trials gave, and how far it agrees with a measured value."""
    agreement = monte_carlo.agreement(measured.value, measured.u, sample, trials)
    return sample.json() | agreement.json()


def _lines(measured: Measured) -> dict[str, Any]:
    degrees = max(1.0, measured.degrees)
    sources = sorted(measured.budget.items(), key=lambda source: -source[1])
    return {
        **measured.json(),
        "degrees": min(degrees, 1e6),
        "k": coverage_factor(degrees),
        "lines": [{"name": name, "u": u, "share": (u / measured.u) ** 2} for name, u in sources],
    }


def _in_fine(row: Measurand, u: float) -> str:
    """Write a standard uncertainty in a quantity's finer unit."""
    fine = row.fine_scale * u
    return f"{fixed(fine, decimals_for(fine)) if fine >= _LEAST else f'< {_LEAST:g}'} {row.fine}"


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
        "high", "d_low", "d_high", "tolerance", "error", "agrees", "decided", "u_ratio"}}}]}``;
        `u_ratio` is the trials' u over the budget's.

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
    drops = {(run.run.number, run.attempt): run for run in analysis.drops}
    samples = monte_carlo.session_monte_carlo(analysis.joint, trials, SEED)
    by_run = [
        {
            "run": number,
            "attempt": attempt,
            "quantities": {
                name: _compare_trials(measured, sample[name], trials)
                | {"u_ratio": sample[name].u / measured.u}
                for name, measured in drops[number, attempt].quantities.items()
            },
        }
        for (number, attempt), sample in zip(analysis.adjusted, samples, strict=True)
    ]
    return {"trials": trials, "seed": SEED, "runs": by_run}

"""``rig analyze --budget``, and ``--session-trials``: what uncertainties are made of."""

from __future__ import annotations

import math
from functools import partial
from statistics import fmean
from typing import TYPE_CHECKING, Any

from rig.analysis import monte_carlo
from rig.analysis.distributions import coverage_factor
from rig.analysis.drop import fit_drop
from rig.analysis.result import Measured
from rig.analysis.session import planned_run
from rig.cache.entry import recall
from rig.commands.output import print_found, tell_damage
from rig.errors import InputError
from rig.measurands import MEASURANDS
from rig.protocol.plan import runs
from rig.reasons import sentences
from rig.report.numbers import decimals_for, fixed, plus_minus
from rig.results import calibration, check_open, protocol_of, results
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping

    from rig.analysis.monte_carlo import Propagated
    from rig.analysis.session import Analysis
    from rig.measurands import Measurand
    from rig.results import SessionResults
    from rig.session.reading import Reader

SEED = 1
_LEAST = 0.001  # in the finer unit: less is none


def main(arguments: Namespace) -> int:
    """Print a run's budget in the session's light, and by itself beside Monte Carlo trials."""
    with Session.open(arguments.session, readonly=True) as session:
        asked, fresh = (arguments.budget, arguments.trials, SEED), arguments.fresh
        whole = results(session, fresh=fresh)
        make = partial(budget, session, whole, *asked)
        found = recall(dict, make, "budget", whole.digest, asked, fresh=fresh)
    print_found(found, lambda: "\n".join(_table(found)), as_json=arguments.json)
    return tell_damage(whole.analysis)


def budget(
    session: Reader, whole: SessionResults, number: int, trials: int | str | None, seed: int
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
    alone, fit = fit_drop(protocol, planned, drop, calibration(session).scale(drop))
    if fit is None:
        raise InputError(f"run {number} is void: {sentences(alone.reasons)}")
    records = whole.records()
    record = next(one for one in records if (one["run"], one["attempt"]) == (number, drop.attempt))
    if trials is None:
        trial, drawn = monte_carlo.until_decided(fit, alone.quantities, seed)
    elif isinstance(trials, str):
        trial, drawn = monte_carlo.adaptive(fit, seed)
    else:
        trial, drawn = monte_carlo.monte_carlo(fit, trials, seed), trials
    return {
        "run": number,
        "learned": record["learned"],
        "budget": {name: _lines(_measured(record, name)) for name in record["degrees"]},
        "by_itself": {name: _lines(measured) for name, measured in alone.quantities.items()},
        "monte_carlo": {
            "trials": drawn,
            "seed": seed,
            "quantities": {
                name: _compare_trials(alone.quantities[name], sample, drawn)
                for name, sample in trial.items()
            },
        },
    }


def _measured(record: Mapping[str, Any], name: str) -> Measured:
    """Return a measured value as a drop's record has it."""
    found, degrees = record[name], record["degrees"][name]
    lines = {one["name"]: one["u"] for one in record["budget"] if one["quantity"] == name}
    return Measured(found["value"], found["u"], math.inf if degrees is None else degrees, lines)


def _compare_trials(measured: Measured, sample: Propagated, trials: int) -> dict[str, Any]:
    """Write what trials gave, and how far it agrees with a measured value."""
    agreement = monte_carlo.agreement(measured.value, measured.u, sample, trials)
    return sample.json() | agreement.json()


def _lines(measured: Measured) -> dict[str, Any]:
    degrees = max(1.0, measured.degrees)
    return {
        **measured.json(),
        "degrees": min(degrees, 1e6),
        "k": coverage_factor(degrees),
        "lines": [
            {"name": name, "u": u, "share": (u / measured.u) ** 2}
            for name, u in sorted(measured.budget.items(), key=lambda line: -line[1])
        ],
    }


def _table(found: Mapping[str, Any]) -> list[str]:
    """One block a quantity, in its own unit and, of what makes it uncertain, the finer one."""
    lines = [f"run {found['run']}"]
    drawn = found["monte_carlo"]
    for name, one in found["budget"].items():
        row = MEASURANDS[name]
        whole = plus_minus(one, row.scale)
        lines += [
            "",
            f"{row.symbol} = {whole} {row.unit} (U, 95 %), "
            f"u = {_written(row, one['u'])} {row.fine}, "
            f"ν = {one['degrees']:.0f}, k = {one['k']:.2f}",
        ]
        lines += [
            f"  {line['name']:<18}{_written(row, line['u']):>10} {row.fine:<5}"
            f"{100 * line['share']:6.1f} %"
            for line in one["lines"]
        ]
        alone, trial = found["by_itself"][name], drawn["quantities"][name]
        digits = decimals_for(row.scale * trial["u"])
        low, high = (fixed(row.scale * trial[end], digits) for end in ("low", "high"))
        lines += [
            f"  by itself u = {_written(row, alone['u'])} {row.fine}; by {drawn['trials']} "
            f"trials (seed {drawn['seed']}) {_written(row, trial['u'])} {row.fine}",
            f"  95 % of trials in {low} … {high} {row.unit}",
        ]
        if trial["decided"]:
            lines[-1] += ": both agree" if trial["agrees"] else ": they do not agree"
    return lines


def _written(row: Measurand, u: float) -> str:
    """Write a standard uncertainty in a quantity's finer unit."""
    fine = row.fine_scale * u
    return fixed(fine, decimals_for(fine)) if fine >= _LEAST else f"< {_LEAST:g}"


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
    results = {
        (result.run.number, result.attempt): result
        for result in (*analysis.runs, *analysis.superseded)
    }
    drawn = monte_carlo.session_monte_carlo(analysis.joint, trials, SEED)
    runs = []
    for key, one in zip(analysis.adjusted, drawn, strict=True):
        quantities = {
            name: _compare_trials(measured, one[name], trials)
            | {"u_ratio": one[name].u / measured.u}
            for name, measured in results[key].quantities.items()
        }
        runs.append({"run": key[0], "attempt": key[1], "quantities": quantities})
    return {"trials": trials, "seed": SEED, "runs": runs}


def trials_lines(found: Mapping[str, Any]) -> Iterator[str]:
    """Say in words how far both ways agree."""
    yield f"Monte Carlo of the whole session: {found['trials']} trials, seed {found['seed']};"
    yield "95 % intervals beside value ± 1.96 u (JCGM 101, clause 8)"
    names = found["runs"][0]["quantities"]
    for name in names:
        ones = [run["quantities"][name] for run in found["runs"]]
        agree = sum(one["agrees"] for one in ones)
        chance = sum(not one["decided"] for one in ones)
        ratio = fmean(one["u_ratio"] for one in ones)
        said = f"{agree} of {len(ones)} agree, {chance} undecided"
        symbol = MEASURANDS[name].symbol
        yield f"  {symbol:<12} u by trials / u by budget {ratio:.3f}, {said}"

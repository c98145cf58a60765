"""``rig analyze --budget``: what the uncertainties of a run are made of."""

from functools import partial
from typing import Any

from rig.analysis.budget_lines import largest_first
from rig.analysis.distributions import coverage_factor
from rig.analysis.monte_carlo import agreement, monte_carlo
from rig.analysis.result import Measured
from rig.analysis.session import drop_case
from rig.cache.entry import recall
from rig.commands.output import Arguments, print_data, progress
from rig.reasons import rig_error, sentences
from rig.report.numbers import ranges
from rig.report.templates import sentence
from rig.results.whole import SessionResults, calibration, check_open, protocol_of
from rig.session.reading import Reader

SEED = 1


def print_budget(session: Reader, outcome: SessionResults, arguments: Arguments) -> None:
    """Print a run's budget in the session's light, and by itself."""
    asked = arguments.budget, arguments.trials, SEED
    make = partial(budget, session, outcome, *asked)
    account = recall(dict, make, "budget", outcome.digest, asked, fresh=arguments.fresh)
    print_data(account, sentence("budget", account).split("\n"), as_json=arguments.json)


def budget(
    session: Reader, outcome: SessionResults, number: int, trials: int | None, seed: int
) -> dict[str, Any]:
    """Account for the uncertainty of a run's results, in the light of all runs and by itself.

    Parameters
    ----------
    outcome
        Results of the session.
    number
        Of the run.
    trials, seed
        Of a Monte Carlo propagation of the run by itself (JCGM 101); none if not given.

    Raises
    ------
    InputError
        A run that was not recorded, or is void.
    """
    drop = next(iter(session.latest_drops(number)), None)
    if drop is None:
        recorded = ranges("run", (result.run.number for result in outcome.analysis.runs))
        raise rig_error("run_unrecorded", path=session.path, run=number, runs=recorded)
    check_open(session)
    single, fit = drop_case(protocol_of(session), drop, calibration(session).scale(drop)).read()
    if fit is None:
        raise rig_error("run_void", run=number, text=sentences(single.reasons))
    result = next(result for result in outcome.analysis.runs if result.run.number == number)
    account = {
        "simulated": outcome.simulated,
        "run": number,
        "learned": result.learned,
        "budget": {name: _lines(value) for name, value in result.quantities.items()},
        "by_itself": {name: _lines(value) for name, value in single.quantities.items()},
    }
    if trials is None:
        return account
    quantities = {}
    show = partial(progress, label="trial")
    for name, sample in monte_carlo(fit, trials, seed, show).items():
        measured = single.quantities[name]
        quantities[name] = sample._asdict() | agreement(measured.value, measured.u, sample, trials)
    return account | {"monte_carlo": {"trials": trials, "seed": seed, "quantities": quantities}}


def _lines(measured: Measured) -> dict[str, Any]:
    degrees = max(1.0, measured.degrees)
    return {
        **measured.json(),
        "degrees": min(degrees, 1e6),
        "k": coverage_factor(degrees),
        "lines": [
            {"name": name, "u": u, "share": (u / measured.u) ** 2}
            for name, u in largest_first(measured.budget).items()
        ],
    }

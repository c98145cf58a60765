"""Which attempt comes next, and what it takes: the rules of a plan on its way."""

from collections.abc import Iterable, Mapping

from rig.protocol.protocol import Run
from rig.recorder.run_lines import RunLine
from rig.records import Job

ATTEMPTS = 3
"""How often a void run is made before it stays void."""
SETTLED = ("accepted", "marginal", "rejected")
CLOCK_U = 1e-4
"""How well the device's clock must be known before a drop, relative: a resonator that is off by
0.13 % spreads a chain's edges over the wrong rods."""
CLOCK_S = 2.0  # of clock samples are plenty for that


def next_job(runs: Iterable[RunLine], voids: Mapping[int, int]) -> Job | None:
    """Name the next attempt of the plan; `None` when it is done.

    Parameters
    ----------
    runs
        The plan, in order.
    voids
        How many attempts at each run were void, as from `rig.campaign.voids.Voids.counts`.
    """
    return next((line.again for line in runs if not done(line, voids.get(line.run, 0))), None)


def done(line: RunLine, voids: int) -> bool:
    """Whether a run is done with: settled, or void too often."""
    return line.state in SETTLED or voids >= ATTEMPTS


def job_to_judge(runs: Iterable[RunLine]) -> Job | None:
    """Name a drop that was recorded and never judged."""
    return next((Job(line.run, line.attempt) for line in runs if line.state == "recorded"), None)


def rest_s(settle_s: float, clock_u: float | None) -> float:
    """Say how long chains rest before a drop: longer while the device's clock is not known.

    Parameters
    ----------
    settle_s
        What the protocol wants.
    clock_u
        Relative standard uncertainty of the clock's rate; `None` before it was compared.
    """
    known = clock_u is not None and clock_u <= CLOCK_U
    return settle_s if known else max(settle_s, CLOCK_S)


def describe_setup(run: Run) -> str:
    """Tell the operator what goes where before a drop."""
    if run.impact is None:
        return f"put {run.free} at its start{run.setting and f' ({run.setting})'}, at rest"
    chains = f"impact side: {run.impact} · free side: {run.free}"
    return f"incline {run.set_up} · {chains if run.free else f'hang {run.impact}'}"

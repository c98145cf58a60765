"""Sensitivity of results to priors that are three times wider or narrower.

The session is fitted again with each change, from its present solution. A linear formula would not
do: a stated scatter has little weight if the drops determine it.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from rig.analysis.budgets import Budgets
from rig.analysis.fit import alone
from rig.analysis.joint_fit import by_itself, joint_fit
from rig.analysis.session import Analysis
from rig.analysis.summary import Incline, summarize
from rig.protocol.protocol import Priors, Protocol
from rig.threads import one_thread

FACTOR = 3.0


@one_thread
def prior_sensitivity(protocol: Protocol, analysis: Analysis) -> list[dict[str, Any]]:
    """Fit a session again with each prior wider and narrower.

    Returns
    -------
    list of dict
        ``prior_sensitivity`` of ``rig analyze --priors --json``: a row for each prior, incline and
        measurand, with the change of the mean and the ratio of its U95.
    """
    if not analysis.adjusted:
        return []
    unchanged = _again(protocol, analysis)
    rows = []
    for name, place in _priors(protocol).items():
        wider, narrower = (_again(protocol, analysis, place, by) for by in (FACTOR, 1.0 / FACTOR))
        # A prior whose joint fit did not converge is left out.
        for line, *changed in zip(unchanged, wider, narrower, strict=False):
            for quantity, mean in line.means.items():
                row: dict[str, Any] = {"prior": name, **line.condition.json(), "quantity": quantity}
                for word, other in zip(("wider", "narrower"), changed, strict=True):
                    row[word] = other.means[quantity].value - mean.value
                    row[f"U95_ratio_{word}"] = other.means[quantity].expanded / mean.expanded
                rows.append(row)
    return rows


def _again(
    protocol: Protocol, analysis: Analysis, place: tuple[str, ...] = (), by: float = 1.0
) -> tuple[Incline, ...]:
    """Return the summary with a prior multiplied; empty if the fit diverges."""
    fits = []
    for drop in analysis.adjusted.values():
        own = drop.model.protocol.stated or drop.model.protocol
        changed = _scale_at(own, place, by) if place else own
        fits.append(replace(drop, model=drop.model.under(changed)))
    joints = [joint_fit(fits)] if analysis.joint else [by_itself(alone(fit)) for fit in fits]
    if analysis.joint and not joints[0].settled:
        return ()
    results = [fit.measure_all(drop) for fit in map(Budgets, joints) for drop in fit.joint.drops]
    by_job = dict(zip(analysis.adjusted, results, strict=True))
    runs = [replace(run, quantities=by_job.get(run.job, run.quantities)) for run in analysis.runs]
    return summarize(protocol, runs)


def _priors(protocol: Protocol) -> dict[str, tuple[str, str]]:
    """Return the attribute path of each prior in a protocol, by its key."""
    places = {prior.name: ("priors", prior.name) for prior in fields(Priors)} | {
        "height_uncertainty": ("gates", "height_u"),
        "datum_uncertainty": ("gates", "datum_u"),
        "position_uncertainty": ("chains", "position_u"),
        "width_uncertainty": ("chains", "width_u"),
        "drop": ("drop", "u"),
    }
    return places if protocol.surface is None else places | {"gravity": ("gravity", "u")}


def _scale_at(value: Any, place: tuple[str, ...], by: float) -> Any:
    """Return a copy with the number at an attribute path multiplied, also in mappings."""
    if isinstance(value, Mapping):
        return {name: _scale_at(member, place, by) for name, member in value.items()}
    if not place:
        return by * value
    return replace(value, **{place[0]: _scale_at(getattr(value, place[0]), place[1:], by)})

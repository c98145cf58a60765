"""How much results would move if a prior were three times wider, or narrower.

Everything is adjusted again with each of them, from where it is: of a scatter that drops tell, what
was stated is one member among many, and no linear formula knows how little that is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from rig.analysis.budgets import Budgets
from rig.analysis.fit import alone
from rig.analysis.joint_fit import by_itself, joint_fit
from rig.analysis.summary import summarize
from rig.protocol.protocol import Priors
from rig.threads import one_thread

if TYPE_CHECKING:
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.protocol.protocol import Protocol

FACTOR = 3.0


@one_thread
def prior_sensitivity(analysis: Analysis) -> list[dict[str, Any]]:
    """Adjust a session again with each prior wider and narrower.

    Returns
    -------
    list of dict
        ``prior_sensitivity`` of ``rig analyze --priors --json``: one a prior, incline and
        measurand, with what the mean moves by and what its U95 becomes times itself.
    """
    if not analysis.adjusted:
        return []
    protocol = next(iter(analysis.adjusted.values())).model.protocol
    protocol = protocol.stated or protocol
    unchanged = _again(protocol, analysis)
    rows = []
    for name, place in _priors(protocol).items():
        changed = (_widened(protocol, place, by) for by in (FACTOR, 1.0 / FACTOR))
        wider, narrower = (_again(changed_protocol, analysis) for changed_protocol in changed)
        # Without one of these a prior's line is left out: its joint fit did not converge.
        for line, wide, narrow in zip(unchanged or (), wider or (), narrower or (), strict=False):
            for quantity, mean in line.means.items():
                row: dict[str, Any] = {"prior": name, **line.condition.json(), "quantity": quantity}
                for word, changed_protocol in (("wider", wide.means), ("narrower", narrow.means)):
                    row[word] = changed_protocol[quantity].value - mean.value
                    row[f"U95_ratio_{word}"] = changed_protocol[quantity].expanded / mean.expanded
                rows.append(row)
    return rows


def _again(protocol: Protocol, analysis: Analysis) -> list[Incline] | None:
    """Means as they are with the priors of another protocol, if the joint fit converges."""
    drops = {
        key: replace(drop, model=drop.model.under(protocol))
        for key, drop in analysis.adjusted.items()
    }
    if analysis.joint is None:
        joints = [by_itself(alone(drop)) for drop in drops.values()]
    else:
        joints = [joint_fit(list(drops.values()))]
        if not joints[0].settled:
            return None
    results = (fit.measured(drop) for fit in map(Budgets, joints) for drop in fit.joint.drops)
    results_by_key = dict(zip(drops, results, strict=True))
    return summarize(
        protocol,
        (
            replace(
                run, quantities=results_by_key.get((run.run.number, run.attempt), run.quantities)
            )
            for run in analysis.runs
        ),
    )


def _priors(protocol: Protocol) -> dict[str, tuple[str, ...]]:
    """Return where a protocol has each prior, by its key."""
    places: dict[str, tuple[str, ...]] = {
        prior.name: ("priors", prior.name) for prior in fields(Priors)
    }
    places["height_uncertainty"] = ("gates", "height_u")
    places["datum_uncertainty"] = ("gates", "datum_u")
    places["position_uncertainty"] = ("chains", "position_u")
    places["width_uncertainty"] = ("chains", "width_u")
    places["drop"] = ("drop", "u")
    return places if protocol.surface is None else places | {"gravity": ("gravity", "u")}


def _widened(value: Any, place: tuple[str, ...], by: float) -> Any:
    """Return something with the number at a place multiplied; of several things that of each."""
    if isinstance(value, Mapping):
        return {name: _widened(member, place, by) for name, member in value.items()}
    if not place:
        return by * value
    return replace(value, **{place[0]: _widened(getattr(value, place[0]), place[1:], by)})

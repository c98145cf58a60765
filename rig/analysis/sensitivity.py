"""How much results would move if a prior were three times wider, or narrower.

Everything is adjusted again with each of them, from where it is: of a scatter that drops tell, what
was stated is one member among many, and no linear formula knows how little that is.
"""

from __future__ import annotations

from dataclasses import fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from rig.analysis.adjust import adjust
from rig.analysis.budgets import Budgets
from rig.analysis.fit import Fit
from rig.analysis.joint_fit import by_itself, joint_fit
from rig.analysis.summary import summarize
from rig.protocol.protocol import Priors
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.protocol.protocol import Gates, Protocol

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
    here = _again(protocol, analysis)
    rows = []
    for name, scaled in _priors(protocol):
        wider, narrower = (_again(scaled(by), analysis) for by in (FACTOR, 1.0 / FACTOR))
        # Without one of these a prior's line is left out: its joint fit did not converge.
        for line, wide, narrow in zip(here or (), wider or (), narrower or (), strict=False):
            for quantity, mean in line.means.items():
                row: dict[str, Any] = {"prior": name, **line.condition.json(), "quantity": quantity}
                for word, other in (("wider", wide.means), ("narrower", narrow.means)):
                    row[word] = other[quantity].value - mean.value
                    row[f"U95_ratio_{word}"] = other[quantity].expanded / mean.expanded
                rows.append(row)
    return rows


def _again(protocol: Protocol, analysis: Analysis) -> list[Incline] | None:
    """Means as they are with the priors of another protocol, if the joint fit converges."""
    drops = {
        key: replace(drop, model=drop.model.under(protocol))
        for key, drop in analysis.adjusted.items()
    }
    if analysis.joint is None:
        joints = [
            by_itself(Fit(one.model, one.matches, adjust(one.model, one.matches, one.x.copy())))
            for one in drops.values()
        ]
    else:
        joints = [joint_fit(list(drops.values()))]
        if not joints[0].settled:
            return None
    results = (one.measured(drop) for one in map(Budgets, joints) for drop in one.joint.drops)
    found = dict(zip(drops, results, strict=True))
    return summarize(
        protocol,
        (
            replace(run, quantities=found.get((run.run.number, run.attempt), run.quantities))
            for run in analysis.runs
        ),
    )


def _priors(protocol: Protocol) -> Iterator[tuple[str, Callable[[float], Protocol]]]:
    """Each prior by its key, and the protocol with that one times a factor."""
    gates = protocol.gates
    assert gates is not None
    for one in fields(Priors):
        yield one.name, partial(_with_prior, protocol, one.name)
    yield "height_uncertainty", lambda by: _with_gates(protocol, gates, height=by)
    yield "datum_uncertainty", lambda by: _with_gates(protocol, gates, datum=by)
    for key in ("position_u", "width_u"):
        yield f"{key}ncertainty", partial(_with_chains, protocol, key)
    yield "drop", lambda by: replace(protocol, drop=replace(protocol.drop, u=by * protocol.drop.u))
    if protocol.surface is not None:
        wider = protocol.gravity
        yield "gravity", lambda by: replace(protocol, gravity=replace(wider, u=by * wider.u))


def _with_prior(protocol: Protocol, name: str, by: float) -> Protocol:
    priors = protocol.priors
    return replace(protocol, priors=replace(priors, **{name: by * getattr(priors, name)}))


def _with_gates(
    protocol: Protocol, gates: Gates, height: float = 1.0, datum: float = 1.0
) -> Protocol:
    height_u, datum_u = height * gates.height_u, datum * gates.datum_u
    return replace(protocol, gates=replace(gates, height_u=height_u, datum_u=datum_u))


def _with_chains(protocol: Protocol, name: str, by: float) -> Protocol:
    chains = {
        key: replace(rods, **{name: by * getattr(rods, name)})
        for key, rods in protocol.chains.items()
    }
    return replace(protocol, chains=chains)

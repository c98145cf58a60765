"""Drops as they would fall, and what each beam would say of their unknowns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.air import prior_air
from rig.analysis.annealing import Guess
from rig.analysis.chain_records import ChainRecord, EdgeTrain, chain_records
from rig.analysis.drop_model import DropModel
from rig.analysis.quantities import measurands
from rig.analysis.trajectory import Trajectory, free_trajectory, struck_trajectory
from rig.analysis.unknowns import SharedUnknowns
from rig.model.rods import rod_impacts
from rig.protocol.contact import at_contact
from rig.protocol.measurable import check_gates
from rig.protocol.plan import runs
from rig.protocol.protocol import Gate, Protocol, Run
from rig.protocol.protocol import Side as Role
from rig.records import Drop
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.components import Components
    from rig.arrays import Array, Index


CLOCK_U = 1e-6
"""Of a board's rate after some minutes of comparing it with the computer's clock, relative."""
_CHANCE = ("impulses", "hang")
RELEASE_S = 0.02
"""After the release fired; any will do."""
_BEAMS = ("beams", "ripple")
BEAM = len(_BEAMS)
"""Unknowns that a beam has for itself: its height, and how far off the rods' middle it is."""


@dataclass(frozen=True, slots=True)
class Block:
    """What one beam says of one drop: its observation equations in standard deviations.

    Attributes
    ----------
    columns
        Unknowns of the drop that it knows of.
    slopes
        By these and the beam's own, in units of prior uncertainties; one row an edge.
    """

    columns: Index
    slopes: Array


@dataclass(frozen=True, slots=True)
class Case:
    """One kind of drop: an incline, and which chain strikes.

    Attributes
    ----------
    run, count
        A run of this kind, and how many the plan has.
    own, struck
        Number of unknowns of the drop alone, α left out, and of α: 1 where something is struck.
    here, shared
        Place of each of the others in the session's vector, beams left out; and its length.
    by_chance
        Of a drop's own unknowns those that differ from run to run: single impulses, hanging height.
    gradients
        Of each measurand by all these unknowns: own, α, common.
    blocks
        One a beam.
    """

    run: Run
    count: int
    own: int
    struck: int
    here: Index
    shared: int
    by_chance: Index
    gradients: dict[str, Array]
    blocks: tuple[Block, ...]

    @property
    def core(self) -> int:
        """Number of unknowns that are no beam's."""
        return self.own + self.here.size + self.struck


def beams_of(protocol: Protocol) -> list[tuple[Role, float]]:
    """Side and height of each beam of a protocol.

    Raises
    ------
    InputError
        Where it has none.
    """
    return [(gate.side, gate.height) for gate in check_gates(protocol).gates]


def with_beams(protocol: Protocol, beams: Sequence[tuple[Role, float]]) -> Protocol:
    """The protocol with these beams instead of its own."""
    assert protocol.gates is not None
    gates = tuple(Gate(n, height, side) for n, (side, height) in enumerate(beams))
    return replace(protocol, gates=replace(protocol.gates, gates=gates))


@one_thread
def cases(
    protocol: Protocol,
    beams: Sequence[tuple[Role, float]],
    components: Components,
    inclines: Sequence[float] | None = None,
) -> tuple[Case, ...]:
    """Work out what beams at these heights say of every kind of drop, in order of incline.

    Parameters
    ----------
    protocol
        The scene and its plan; where its gates are does not matter.
    beams
        Side and height of each.
    components
        How much everything scatters.
    inclines
        Only these, if given.

    """
    protocol = with_beams(protocol, beams)
    planned = [run for run in runs(protocol) if inclines is None or run.incline_deg in inclines]
    kinds: dict[tuple[object, ...], list[Run]] = {}
    for run in planned:
        kinds.setdefault((run.incline_deg, run.impact, run.free), []).append(run)
    alike = sorted(kinds.values(), key=lambda group: (group[0].incline_deg, str(group[0].impact)))
    models = [_model(protocol, group[0], components) for group in alike]
    shared = SharedUnknowns(model for model, _ in models)
    # Beams are left out here and added by each layout: the rest is worked out once for all.
    places = np.full(len(shared), -1)
    others = np.setdiff1d(np.arange(len(shared)), _places(shared.blocks, *_BEAMS))
    places[others] = np.arange(others.size)
    return tuple(
        _case(group, model, x, shared, places)
        for group, (model, x) in zip(alike, models, strict=True)
    )


def _places(blocks: Mapping[str, slice], *names: str) -> Index:
    """Return the places of the unknowns whose block's name ends so."""
    every = [np.arange(at.start, at.stop) for name, at in blocks.items() if name.endswith(names)]
    return np.concatenate([np.zeros(0, dtype=np.intp), *every])


def perfect(protocol: Protocol, run: Run, lower: float = 0.0) -> list[tuple[ChainRecord, Array]]:
    """Each chain of a drop as the model predicts it, with every edge seen.

    Parameters
    ----------
    lower
        By how much the chains hang lower than stated, m.

    Returns
    -------
    list
        Records with their trains, and α of each rod, shape ``(rods,)``; empty for a free chain.
    """
    collected = []
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    for record in records_of(protocol, run):
        alphas = model_alphas(protocol, record, run)
        path = trajectory(protocol, record, RELEASE_S, protocol.drop.value - lower, alphas)
        trains = tuple(
            with_edges(train, path.times(train.levels), train.blocks) for train in record.trains
        )
        collected.append((replace(record, trains=trains), alphas))
    return collected


def records_of(protocol: Protocol, run: Run) -> list[ChainRecord]:
    """Return the chains of a drop that no beam has seen yet."""
    return chain_records(protocol, run, Drop(run.number, 1, 1, ()), 1.0)


def model_alphas(protocol: Protocol, record: ChainRecord, run: Run) -> Array:
    """α of each rod by the model, shape ``(rods,)``; empty for a free chain."""
    if record.ratios is None:
        return np.zeros(0)
    assert protocol.surface is not None
    impacts = rod_impacts(protocol.surface, record.chain.chain, run.incline_deg)
    return np.array([impact.alpha for impact in impacts])


def trajectory(
    protocol: Protocol,
    record: ChainRecord,
    release: float,
    start: float,
    alphas: Array,
    rods: Array | float = 0.0,
) -> Trajectory:
    """Let a chain fall whose rods hang so much higher than stated, m."""
    gravity, kappa = protocol.gravity.value, prior_air(protocol)[0]
    if record.ratios is None:
        return free_trajectory(release, start, gravity, kappa, record.air)
    strikes = record.strikes + rods
    return struck_trajectory(
        release, start, gravity, alphas, record.ratios, strikes, kappa, record.air
    )


def _model(protocol: Protocol, run: Run, components: Components) -> tuple[DropModel, Array]:
    """The equations of the drop as the model predicts it."""
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    records = perfect(protocol, run)
    guesses: dict[str, Guess] = {
        record.role: Guess(
            RELEASE_S, protocol.drop.value, float(alphas.mean()) if alphas.size else 0.0
        )
        for record, alphas in records
    }
    model = DropModel(protocol, [record for record, _ in records], guesses, CLOCK_U, components)
    x = np.zeros(len(model.unknowns))
    for _, alphas in records:
        if alphas.size:
            x[model.unknowns["impulses"]] = alphas - alphas.mean()
    return model, x


def with_edges(train: EdgeTrain, times: Array, blocked: NDArray[np.bool_]) -> EdgeTrain:
    """Return the train of a beam that saw these edges and no flicker."""
    number = np.arange(times.size)
    return replace(train, times=times, blocked=blocked, burst=0.0 * times, edge=number)


def _case(
    alike: Sequence[Run], model: DropModel, x: Array, shared: SharedUnknowns, places: Index
) -> Case:
    """Work out one kind of drop; `places` are those of shared unknowns without beams, else −1."""
    at, sd = model.unknowns, model.unknowns.sd
    common, shared_places = shared.places(model)
    here = places[shared_places]
    common, here = common[here >= 0], here[here >= 0]
    alpha, beams = _places(at.blocks, "alpha"), _places(at.blocks, *_BEAMS)
    # Own first, then α, then common, as `Case` has them: eliminated from the front.
    own = np.setdiff1d(np.arange(len(at)), np.concatenate([common, alpha, beams]))
    order = np.concatenate([own, alpha, common])
    place = np.full(len(at), -1)
    place[order] = np.arange(order.size)
    blocks: dict[int, Block] = {}
    for role, record in model.records.items():
        blocks |= _blocks(model, record, role, x, place)
    return Case(
        alike[0],
        len(alike),
        own.size,
        alpha.size,
        here,
        int(places.max(initial=-1)) + 1,
        place[_places(at.blocks, *_CHANCE)],
        {name: (measurand.slopes * sd)[order] for name, measurand in measurands(model, x).items()},
        tuple(blocks.get(n, _BLIND) for n in range(at[_BEAMS[0]].stop - at[_BEAMS[0]].start)),
    )


_BLIND = Block(np.zeros(0, dtype=np.intp), np.zeros((0, BEAM)))


def _blocks(
    model: DropModel, record: ChainRecord, role: str, x: Array, place: Index
) -> dict[int, Block]:
    """Split the equations of one chain by beam."""
    at, sd = model.unknowns, model.unknowns.sd
    rows = model.equations(role, x, [np.arange(train.times.size) for train in record.trains])
    slopes = rows.slopes * (sd[rows.columns] / rows.residuals.sigma[:, None])
    gate = model.expected[role].gate
    columns = np.flatnonzero(place[rows.columns] >= 0)
    where = np.full(len(at), -1)
    where[rows.columns] = np.arange(rows.columns.size)
    collected = {}
    for train in record.trains:
        own = [where[at[name].start + train.gate] for name in _BEAMS if name in at]
        chosen = slopes[gate == train.gate][:, [*columns, *own]]
        part = np.zeros((chosen.shape[0], columns.size + BEAM))
        part[:, : chosen.shape[1]] = chosen
        collected[train.gate] = Block(place[rows.columns[columns]], part)
    return collected

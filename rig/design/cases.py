"""Drops as they would fall, and what each beam would say of their unknowns."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.chain_records import ChainRecord, ObservedEdges, chain_records
from rig.analysis.components import Components
from rig.analysis.drop_model import DropModel
from rig.analysis.owners import suffixes
from rig.analysis.quantities import measurands
from rig.analysis.square_root import EquationRows
from rig.analysis.unknowns import SharedUnknowns
from rig.arrays import Array, Index
from rig.estimate.hypotheses import model_alpha
from rig.estimate.session import check_alike
from rig.protocol.contact import of_run
from rig.protocol.protocol import Protocol, Run
from rig.records import Drop
from rig.threads import one_thread

CLOCK_U = 1e-6
"""Of a board's rate after some minutes of comparing it with the computer's clock, relative."""
_CHANCE = ("impulses", "hang")
RELEASE_S = 0.02
"""After the release fired; any will do."""
_BEAMS = ("beams", "ripple")
BEAM = len(_BEAMS)
"""Unknowns that a beam has for itself: its height, and how far off the rods' middle it is."""


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
        What each beam says of one drop, in units of prior uncertainties; one row an edge. The
        places of its own unknowns, at most `BEAM`, are behind all these.
    """

    run: Run
    count: int
    own: int
    struck: int
    here: Index
    shared: int
    by_chance: Index
    gradients: dict[str, Array]
    blocks: tuple[EquationRows, ...]

    @property
    def core(self) -> int:
        """Number of unknowns that are no beam's."""
        return self.own + self.here.size + self.struck

    def block(self, beam: int, place: int) -> EquationRows:
        """Return what a beam says, if its own unknowns have this place among those of beams."""
        rows = self.blocks[beam]
        return rows._replace(columns=rows.columns + BEAM * place * (rows.columns >= self.core))


@one_thread
def cases(protocol: Protocol, components: Components) -> tuple[Case, ...]:
    """Work out what a protocol's beams say of every kind of drop, in order of incline.

    Parameters
    ----------
    components
        How much everything scatters.
    """
    check_alike(protocol)
    counts = Counter(run.kind for run in protocol.runs())
    kinds = sorted(counts, key=lambda run: (run.incline_deg, str(run.impact)))
    models = []
    for run in kinds:
        model, x = predict_drop(of_run(protocol, run), run, components)
        seen = perfect(model, x)
        models.append((DropModel(model.protocol, seen, CLOCK_U, components), x))
        models[-1][0].owners = suffixes(protocol, run)
    shared = SharedUnknowns(model for model, _ in models)
    # Beams are left out here and added by each layout: the rest is worked out once for all.
    places = np.full(len(shared), -1)
    others = np.setdiff1d(np.arange(len(shared)), _places(shared.blocks, *_BEAMS))
    places[others] = np.arange(others.size)
    return tuple(
        _case(run, counts[run], model, x, shared, places)
        for run, (model, x) in zip(kinds, models, strict=True)
    )


def _places(blocks: Mapping[str, slice], *names: str) -> Index:
    """Return the places of the unknowns whose block's name ends so."""
    every = [np.arange(at.start, at.stop) for name, at in blocks.items() if name.endswith(names)]
    return np.concatenate([np.zeros(0, dtype=np.intp), *every])


def predict_drop(protocol: Protocol, run: Run, components: Components) -> tuple[DropModel, Array]:
    """Return a drop that no beam has seen yet, and its unknowns as the model predicts them.

    Parameters
    ----------
    protocol
        With heights counted from the contact point.
    """
    records = chain_records(protocol, run, Drop(run.number, 1, 1, ()), 1.0)
    alpha = 0.0  # a free chain leaves α alone
    if run.impact is not None:
        chain = protocol.chains[run.impact].chain
        alpha, _ = model_alpha(protocol, chain, run.incline_deg, {})
    model = DropModel(protocol, records, CLOCK_U, components, alpha)
    x: Array = np.array(RELEASE_S * model.unknowns.flat)  # only α and releases have no prior
    x[model.unknowns.blocks.get("alpha", slice(0))] = alpha
    return model, x


def perfect(model: DropModel, x: Array) -> list[ChainRecord]:
    """Each chain of a drop with every edge seen where it should be."""
    return [
        with_edges(record, np.arange(record.edge_count), path.times(record.due.levels))
        for role, record in model.records.items()
        for path in [model.trajectory(role, x)]
    ]


def with_edges(record: ChainRecord, seen: Index, times: Array) -> ChainRecord:
    """Return the chain whose beams saw some of its expected edges, gate by gate, and no flicker.

    The number of each edge is that of the expected edge that it is.
    """
    _, blocks, _, gate, _ = record.due
    edges = ObservedEdges(times, blocks[seen], 0.0 * times, seen, gate[seen])
    return replace(record, edges=edges)


def _case(
    run: Run, count: int, model: DropModel, x: Array, shared: SharedUnknowns, places: Index
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
    blocks = dict(_blocks(model, x, place))
    return Case(
        run,
        count,
        own.size,
        alpha.size,
        here,
        int(places.max(initial=-1)) + 1,
        place[_places(at.blocks, *_CHANCE)],
        {name: (measurand.slopes * sd)[order] for name, measurand in measurands(model, x).items()},
        tuple(blocks.get(n, _BLIND) for n in range(at[_BEAMS[0]].stop - at[_BEAMS[0]].start)),
    )


_BLIND = EquationRows(np.zeros((0, 0)), np.zeros(0), np.zeros(0, dtype=np.intp))


def _blocks(model: DropModel, x: Array, place: Index) -> Iterator[tuple[int, EquationRows]]:
    """Yield the equations of each beam, by its number."""
    at, sd = model.unknowns, model.unknowns.sd
    for role, record in model.records.items():
        rows = model.equations(role, x, np.arange(record.edge_count))
        slopes = rows.slopes * (sd[rows.columns] / rows.residuals.sigma[:, None])
        for gate in np.unique(record.due.gate).tolist():
            own = [at[name].start + gate for name in _BEAMS if name in at]
            places = place.copy()
            places[own] = place.max() + 1 + np.arange(len(own))
            seen, known = record.due.gate == gate, places[rows.columns] >= 0
            part = slopes[np.ix_(seen, known)]
            yield gate, EquationRows(part, np.zeros(len(part)), places[rows.columns[known]])

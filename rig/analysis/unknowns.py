"""The table of nuisance parameters and measurands of a drop: names, priors and derivatives.

A row of `TABLE` gives an unknown's name, its line of the uncertainty budget, its prior, the drops
that share it, and its derivatives of a chain's trajectory and of the levels at which edges are
expected. Priors, observation equations, budget and joint fit all read this table. An unknown that
a scene does not have has no prior and is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

import numpy as np

from rig.analysis.chain_records import ChainRecord
from rig.analysis.components import ALPHA_SD, Components, above
from rig.analysis.departures import MODES, SLACK_WAY, drawn, lags, lever, slack, strike_u, swing_sd
from rig.analysis.equations import SHARED, ExpectedEdges, standardise
from rig.analysis.trajectory import COMMON, NAMES, ONE
from rig.arrays import Array, Flags, Index
from rig.predictions import air_of
from rig.protocol.protocol import Gates, Protocol
from rig.text_rows import read_rows

if TYPE_CHECKING:
    from rig.analysis.drop_model import DropModel

    Effect = Callable[["Side"], Array]
    Prior = Callable[["Side"], float | Sequence[float] | Array | None]

ANY_GRAVITY = 5.0
"""Prior standard uncertainty of gravity where it is the measurand, m/s²."""


class Side(NamedTuple):
    """One chain of a drop: the argument of every prior and derivative in the table."""

    model: DropModel
    record: ChainRecord

    @property
    def protocol(self) -> Protocol:
        """Protocol of the scene."""
        return self.model.protocol

    @property
    def gates(self) -> Gates:
        """Photogates of the scene."""
        return self.protocol.gates

    @property
    def edges(self) -> ExpectedEdges:
        """Expected edges of the chain at all its gates."""
        return self.model.expected[self.record.role]

    @property
    def rods(self) -> int:
        """Number of rods of the chain."""
        return self.record.chain.chain.rods

    @property
    def top(self) -> Array:
        """1 for the top rod, 0 for all others."""
        return np.asarray(np.eye(self.rods)[-1])

    @property
    def alpha(self) -> float:
        """Impact coefficient α to which the scatter of single impulses is relative, absolute."""
        return abs(self.model.alpha)

    @property
    def slope(self) -> float:
        """Tangent of the tilt angle of the rods."""
        return math.tan(math.radians(self.record.chain.tilt_deg))

    @property
    def steepest(self) -> float:
        """Largest `slope` of all chains of the drop."""
        return max(Side(self.model, record).slope for record in self.model.records.values())


@dataclass(frozen=True)
class Unknown:
    """A row of the table: a block of unknowns of a drop.

    Attributes
    ----------
    name
        Name of the block; the role of the chain comes before it if each chain has its own block.
    line
        Line of the uncertainty budget.
    sd
        Prior standard uncertainties of the members, before `scale`; infinite without a prior,
        `None` if the scene does not have this unknown.
    of
        Chains that the unknown acts on: ``impact`` or ``free`` for one of them, ``each`` if each
        chain has its own value, ``all`` if both share a value.
    shared
        Drops that share the value: those with the same rig, posts, beams, chain, start height or
        condition, or a single drop. For several sessions see `DropModel.owners`.
    moves
        Parameters of the trajectory that the unknown changes, see `parameters`.
    path
        Derivatives of these parameters, of any shape that broadcasts to ``(parameters, members)``.
    level
        Derivatives of the levels of the expected edges, shape ``(edges, members)``.
    rate
        Derivative of the time scale's relative rate; positive if true times are later.
    scale
        Variance component (`rig.analysis.components.Components`) that multiplies the prior. The
        members' estimates determine it in turn.
    absent
        Share of the prior variance that vanishes where a prediction's equations hold exactly.
    """

    name: str
    line: str
    sd: Prior
    of: Literal["all", "each", "impact", "free"] = "all"
    shared: Literal["rig", "air", "posts", "beams", "start", "chain", "condition", "drop"] = "drop"
    moves: str = ""
    path: Effect = lambda _side: ONE
    level: Effect | None = None
    rate: float = 0.0
    scale: str = ""
    absent: Callable[[Side], float | Array] = lambda _side: 0.0

    def prior(self, side: Side) -> Array | None:
        """Return the prior standard uncertainties, shape ``(members,)``; `None` without members."""
        sd = self.sd(side)
        if sd is None:
            return None
        scale = float(getattr(side.model.components, self.scale)) if self.scale else 1.0
        return np.asarray(scale * np.atleast_1d(sd))


def prior_air(protocol: Protocol) -> tuple[float, float]:
    """Return the prior mean and standard uncertainty of κ of the first chain as a whole, 1/m."""
    if protocol.drag is None:
        return 0.0, protocol.priors.drag
    kappa = air_of(protocol, next(iter(protocol.chains)))[0]
    return kappa, kappa * protocol.drag.relative_u


def _by_gate(side: Side) -> Array:
    return np.asarray(np.eye(len(side.gates.gates))[side.edges.gate])


def _by_post(side: Side) -> Array:
    post = [gate.side == np.array(side.gates.posts) for gate in side.gates.gates]
    return np.asarray(np.array(post, dtype=np.float64)[side.edges.gate])


def _ripple_sd(side: Side) -> list[float] | None:
    return [side.steepest] * len(side.gates.gates) if side.steepest else None


def _beam_ripple(side: Side) -> Array:
    """Derivatives by a beam's sideways offset, in proportion to the tilt of the chain's rods."""
    return -side.slope / side.steepest * side.edges.turn[:, None] * _by_gate(side)


def _swing_sd(side: Side) -> float | None:
    if side.protocol.surface is None or side.rods < 2:
        return None
    return swing_sd(side.record.chain.chain, side.protocol)


def _swung(side: Side) -> Array:
    """Derivatives of the rods' places by swing, each at the moment when the rod strikes."""
    levers = lever(side.record.chain.chain)
    return -drawn(levers, side.protocol, -side.record.strikes)[:, None]


def _impulse_sd(side: Side) -> Array:
    components: Components = side.model.components
    return components.impulses(side.alpha, above(side.record.chain.chain))


def _bounces(side: Side) -> Array:
    """Return the share of the impulses' variance that comes from bouncing strings."""
    sd = _impulse_sd(side)
    bounces = side.model.components.bounce * side.alpha / above(side.record.chain.chain)
    # Zero where impulses are known exactly: strings then do not bounce either.
    return np.asarray(np.divide(bounces, sd, out=np.zeros_like(sd), where=sd > 0.0) ** 2)


def _top_sd(side: Side) -> float:
    """Prior of the top rod alone: it keeps the departure that it had while two rods fell."""
    components = side.model.components
    return math.sqrt(2.0) * math.hypot(components.departure, 0.5 * components.few)


def _stretch_sd(side: Side) -> list[float]:
    """Prior of each stretch mode; the other half of the variance is common to all drops.

    In proportion to the distance that impacts gain by the model; `impulse_floor` of the chain's
    length where they gain hardly any.
    """
    priors, lead = side.protocol.priors, side.model.discrepancy.lead
    size = math.hypot(lead, priors.impulse_floor * side.record.chain.chain.length)
    return [math.sqrt(0.5) * priors.stretch * size] * MODES


def _late_sd(side: Side) -> float:
    """Prior of α of the late pulls, in proportion to bouncing: no edge measures it."""
    priors, bounce = side.protocol.priors, side.alpha * side.model.components.bounce
    most = max(ALPHA_SD, side.alpha * priors.last_impulse)
    share = min(bounce, most) / priors.last_impulse if priors.last_impulse else side.alpha
    return priors.late_pull * share


def _unlike_air_sd(side: Side) -> float | None:
    """Prior of the κ of a chain unlike the first: widths do not give its density."""
    more = abs(float(side.record.air[0]) - 1.0)
    stated = side.protocol.drag is not None or side.record.chain.weighed
    return None if stated or not more else more * side.model.kappa_u


def _lag_sd(side: Side) -> float | None:
    unlike = any(record.unlike.any() for record in side.model.records.values())
    return math.hypot(*prior_air(side.protocol)) if unlike else None


def _lag(side: Side) -> Array:
    return -lags(side.record, side.protocol.drop.value, side.edges.rods, side.edges.levels)


def _slack_sd(side: Side) -> Array | None:
    """Prior of each rod's slack: held by one other rod, like the top rod of the last two.

    A rod that air slows more than those above may lag behind them, as far as air slows it alone:
    strings pull, but do not push. Like strikes before their time, that departs from the equations.
    """
    loose, air = np.minimum.accumulate(side.record.unlike), _lag_sd(side) or 0.0
    lag = (loose - loose.mean()) * side.model.components.landed * air * SLACK_WAY**2 / 3.0
    return np.hypot(_top_sd(side), lag) if side.record.unlike.any() else None


def _slack(side: Side) -> Array:
    return -slack(side.record, side.protocol.drop.value, side.edges.rods, side.edges.levels)


def _turned_sd(side: Side) -> float | None:
    """Prior of the top rod's width in a beam: the last pull turns it by about α rad."""
    turned = side.record.chain.widths[-1] * side.slope * side.alpha
    return turned if side.protocol.priors.departure else None


def _strike_sd(side: Side) -> float:
    """Prior of the strike height; the top rod may strike as high as beams not all rods pass."""
    lying = [side.gates.gates[gate].height for gate in side.record.aside]
    return float(max([strike_u(side.record, side.protocol)[-1], *side.record.heap, *lying]))


def _off_centre_sd(side: Side) -> float | None:
    return side.protocol.priors.off_centre * side.slope if side.steepest else None


def _early_sd(side: Side) -> float:
    """Prior of what edges of a rod that may have struck before have in common."""
    return math.sqrt(SHARED) * side.model.components.landed


PRIORS: dict[str, Prior] = {
    "clock": lambda side: side.model.clock_u,
    "gravity": lambda side: None if side.protocol.surface is None else side.protocol.gravity.u,
    "gravity*": lambda side: ANY_GRAVITY if side.protocol.surface is None else None,
    "drop": lambda side: side.protocol.drop.u,
    "side": lambda side: side.protocol.priors.side if len(side.model.records) > 1 else None,
    "drag": lambda side: side.model.kappa_u,
    "air": _unlike_air_sd,
    "air lag": _lag_sd,
    "slack": _slack_sd,
    "free usual slack": _slack_sd,
    "datum": lambda side: [side.gates.datum_u] * len(side.gates.posts),
    "beams": lambda side: [side.gates.height_u] * len(side.gates.gates),
    "ripple": _ripple_sd,
    "release": lambda _: math.inf,
    "hang": lambda _: 1.0,
    "rods": lambda side: [side.record.chain.position_u] * side.rods,
    "off centre": _off_centre_sd,
    "width": lambda side: side.record.chain.width_u,
    "swing": _swing_sd,
    "alpha": lambda _: math.inf,
    "impulses": _impulse_sd,
    "contact": lambda side: side.protocol.contact.level.u,
    "strike": _strike_sd,
    # Where chains keep to the equations, hardly any heap is left.
    "heap": lambda side: side.model.components.landed if side.record.heap.any() else None,
    "top": _top_sd,
    "turned": _turned_sd,
    "landed": _early_sd,
    "lying": _early_sd,
    "strings": lambda side: side.protocol.priors.strings * abs(side.record.alpha),
    "stretch": _stretch_sd,
    "usual stretch": _stretch_sd,
    "late": _late_sd,
}
PATHS: dict[str, Effect] = {
    "air": lambda side: 1.0 / side.record.air[:1],
    "rods": lambda side: np.eye(side.rods),
    "swing": _swung,
    "impulses": lambda side: np.eye(side.rods),
    "contact": lambda side: side.top[:, None] - 1.0,  # results refer to the top rod's level
    "heap": lambda side: ((side.top - 1.0) * side.record.heap)[:, None],
    "top": lambda side: side.top[:, None],
    "strings": lambda side: above(side.record.chain.chain)[:, None] ** -2.0,
}
LEVELS: dict[str, Effect] = {
    "air lag": _lag,
    "slack": _slack,
    "free usual slack": _slack,
    "datum": _by_post,
    "beams": _by_gate,
    "ripple": _beam_ripple,
    "rods": lambda side: -np.eye(side.rods)[side.edges.rods],
    "off centre": lambda side: -side.edges.turn,
    "width": lambda side: -side.edges.sign,
    "swing": lambda side: side.edges.drawn,
    "top": lambda side: -side.edges.alone.astype(np.float64),
    "turned": lambda side: -side.edges.sign * side.edges.alone,
    "landed": lambda side: -side.edges.landed * side.edges.alone,
    "lying": lambda side: -side.edges.landed * ~side.edges.alone,
    "stretch": lambda side: side.model.discrepancy.stretch,
    "usual stretch": lambda side: side.model.discrepancy.stretch,
}
ABSENT: dict[str, Callable[[Side], float | Array]] = {
    "drag": lambda side: float(side.protocol.drag is None),
    "impulses": _bounces,
}

TABLE = tuple(
    Unknown(
        name.rstrip("*"),
        line,
        PRIORS[name],
        cast(Any, of),
        cast(Any, shared),
        moves,
        PATHS.get(name, lambda _: ONE),
        LEVELS.get(name),
        float(moves == "rate"),
        scale,
        ABSENT.get(name, partial(lambda share, _: share, float(absent))),
    )
    for name, line, of, shared, moves, scale, absent in read_rows(__file__)
)
"""Unknowns in the order of a drop's vector, from ``unknowns.txt``."""


class Unknowns:
    """The vector of a drop's unknowns, divided into named blocks.

    All values are deviations from the protocol, but for release times and α, which have no prior.

    Attributes
    ----------
    rows
        Rows of the table by block name, which starts with the chain's role if each chain has its
        own block.
    blocks
        Slice of the vector for each block, by name.
    sd
        Prior standard uncertainties, shape ``(unknowns,)``; 1 in SI units without a prior.
    flat
        Whether an unknown has no prior, shape ``(unknowns,)``.
    rate
        Derivatives of the time scale, see `Unknown.rate`; shape ``(unknowns,)``.
    """

    def __init__(self, model: DropModel) -> None:
        self.rows: dict[str, Unknown] = {}
        self.blocks: dict[str, slice] = {}
        priors: list[Array] = []
        rates: list[Array] = []
        size = 0
        for name, row, side in _named_rows(model):
            prior = row.prior(side)
            if prior is None:
                continue
            self.rows[name] = row
            self.blocks[name] = block = slice(size, size + prior.size)
            priors.append(prior)
            rates.append(np.full(prior.size, row.rate))
            size = block.stop
        sd: Array = np.concatenate(priors)
        self.flat: Flags = np.isinf(sd)
        self.sd: Array = np.where(self.flat, 1.0, sd)
        self.rate: Array = np.concatenate(rates)

    def pull(self, x: Array) -> Array:
        """Return deviations from the priors in their standard uncertainties; 0 without a prior."""
        return np.where(self.flat, 0.0, standardise(x, self.sd))

    def __len__(self) -> int:
        return self.sd.size

    def __getitem__(self, name: str) -> slice:
        return self.blocks[name]

    def __contains__(self, name: object) -> bool:
        """Whether a block exists and has a member with a prior uncertainty above zero."""
        block = self.blocks.get(str(name))
        return block is not None and bool(self.sd[block].any())


def _named_rows(model: DropModel) -> Iterator[tuple[str, Unknown, Side]]:
    """Yield the name, row and side of every block that the drop's chains may have."""
    sides = {role: Side(model, record) for role, record in model.records.items()}
    first = next(iter(sides.values()))
    for row in (*TABLE, *model.suspects):
        if row.of == "each":
            yield from ((f"{role} {row.name}", row, side) for role, side in sides.items())
        elif row.of == "all" or row.of in sides:
            yield row.name, row, sides.get(row.of, first)


def parameters(struck: int) -> dict[str, slice]:
    """Return the slices of a trajectory's parameters by name, for `struck` rods that strike."""
    spans = {name: slice(place, place + 1) for place, name in enumerate(NAMES)}
    ends = [COMMON, COMMON + struck, COMMON + 2 * struck]
    return spans | {"gains": slice(*ends[:2]), "places": slice(*ends[1:]), "all": slice(0, ends[2])}


class SideSlopes(NamedTuple):
    """Derivatives of one side's path parameters and levels, which are linear in the unknowns.

    Attributes
    ----------
    path
        Derivatives of the trajectory's parameters, shape ``(parameters, unknowns)``.
    levels
        Derivatives of the levels of expected edges, shape ``(edges, unknowns)``.
    columns
        Places in the drop's vector of the unknowns that act on this side; those that change the
        trajectory come first. Shape ``(columns,)``.
    moving
        Derivatives of the trajectory's parameters by those of the columns that change it, shape
        ``(parameters, moving)``.
    sights
        Derivatives of the height between chain and beam at every expected edge, for a trajectory
        that does not change, shape ``(edges, columns)``.
    clocks
        Columns that change the time scale.
    """

    path: Array
    levels: Array
    columns: Index
    moving: Array
    sights: Array
    clocks: Index


def side_slopes(model: DropModel, role: str) -> SideSlopes:
    """Collect the derivatives of one side's trajectory and levels by all unknowns."""
    at, side = model.unknowns, Side(model, model.records[role])
    moved = parameters(0 if side.record.ratios is None else side.rods)
    path = np.zeros((moved["all"].stop, len(at)))
    levels = np.zeros((side.edges.rods.size, len(at)))
    for name, row in at.rows.items():
        if row.of in {"all", role} or (row.of == "each" and name.startswith(role)):
            place = moved.get(row.moves, slice(0, 0))
            if place.stop > place.start:
                path[place, at[name]] = row.path(side)
            if row.level is not None:
                levels[:, at[name]] = row.level(side).reshape(levels[:, at[name]].shape)
    moving = np.flatnonzero(path.any(axis=0))
    still = np.union1d(np.flatnonzero(levels.any(axis=0)), np.flatnonzero(at.rate))
    columns = np.append(moving, np.setdiff1d(still, moving))
    parts = path[:, moving], -levels[:, columns]
    return SideSlopes(path, levels, columns, *parts, np.flatnonzero(at.rate[columns]))


class SharedUnknowns:
    """The vector of unknowns that the drops of a session share.

    A chain's rod spacings are the same whether the chain strikes or falls freely. That separates
    them from beam heights: chains change sides, beams do not.

    Attributes
    ----------
    blocks
        Slice of the vector for each block, by name.
    rows
        Rows of the table, by the same names.
    """

    def __init__(self, models: Iterable[DropModel]) -> None:
        self.blocks: dict[str, slice] = {}
        self.rows: dict[str, Unknown] = {}
        self._size = 0
        for model in models:
            at = model.unknowns
            for name, own in _common(model).items():
                if name not in self.blocks:
                    self.rows[name], size = at.rows[own], at[own].stop - at[own].start
                    self.blocks[name] = slice(self._size, self._size + size)
                    self._size += size

    def __len__(self) -> int:
        return self._size

    def places(self, model: DropModel) -> tuple[Index, Index]:
        """Return the places of a drop's shared unknowns in its own vector and in this one."""
        both = [
            (model.unknowns[own], self.blocks[name])
            for name, own in _common(model).items()
            if name in self.blocks
        ]
        place, common_place = np.arange(len(model.unknowns)), np.arange(len(self))
        return (
            np.concatenate([place[:0], *(place[own] for own, _ in both)]),
            np.concatenate([common_place[:0], *(common_place[common] for _, common in both)]),
        )


def _common(model: DropModel) -> dict[str, str]:
    """Return a drop's own names of its shared blocks, by their names in the session."""
    names: dict[str, str] = {}
    for own, row in model.unknowns.rows.items():
        if row.shared == "drop":
            continue
        name, owner = own, str(row.shared)
        if row.shared == "chain":
            chain = model.records[own.partition(" ")[0]].chain.name
            name, owner = f"{chain} {row.name}", f"chain {chain}"
        elif row.shared == "condition":
            name = f"{own} at {model.records['impact'].condition}"
        names[name + model.owners.get(owner, "")] = own
    return names

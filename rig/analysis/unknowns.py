"""Everything that is not known about a drop: one table, from which all else follows.

A row of `TABLE` says what an unknown is called, its line of the uncertainty budget, what is known
of it beforehand, who has it in common, and what it does to the path of a chain and to the levels at
which edges are expected. Priors, observation equations, budget and joint fit are read from it; a
scene that lacks something lacks its row.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from rig.analysis.air import lags, prior_air, slack
from rig.analysis.components import above
from rig.analysis.discrepancy import MODES
from rig.analysis.swing import drawn, lever, swing_sd
from rig.analysis.trajectory import COMMON, DRAG, GRAVITY, RELEASE, START

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.analysis.drop_model import DropModel
    from rig.analysis.equations import Expected
    from rig.arrays import Array, Index
    from rig.protocol.protocol import Gates, Protocol

    Effect = Callable[["Side"], Array]

ANYTHING = 1.0
"""Prior of release times (s) and α: nothing is known."""
ANY_GRAVITY = 5.0
"""Prior of gravity where it is what a scene measures, m/s²."""


class Side(NamedTuple):
    """A chain of a drop, as the rows of the table look at it."""

    model: DropModel
    record: ChainRecord

    @property
    def protocol(self) -> Protocol:
        """Of the scene."""
        return self.model.protocol

    @property
    def gates(self) -> Gates:
        """Of the scene."""
        assert self.protocol.gates is not None
        return self.protocol.gates

    @property
    def edges(self) -> Expected:
        """Of its gates."""
        return self.model.expected[self.record.role]

    @property
    def rods(self) -> int:
        """How many it has."""
        return self.record.chain.chain.rods

    @property
    def alpha(self) -> float:
        """Of its impacts, as it is guessed."""
        return abs(self.model.guesses["impact"].alpha)

    @property
    def slope(self) -> float:
        """Tangent of the tilt of its rods."""
        return math.tan(math.radians(self.record.chain.tilt_deg))

    @property
    def steepest(self) -> float:
        """That of the drop's more tilted chain."""
        return max(Side(self.model, record).slope for record in self.model.records.values())


@dataclass(frozen=True)
class Unknown:
    """A row of the table: a block of unknowns of a drop.

    Attributes
    ----------
    name
        To find it; after a role where each chain has its own.
    line
        Of the uncertainty budget.
    sd
        Prior standard uncertainties of its members, but for `scale`; `None` where a scene has no
        such unknown.
    of
        Whose it is: ``impact`` or ``free`` for what only that chain knows of, ``each`` where each
        chain has its own, ``all`` for what both have in common.
    shared
        In which drops it is the same: those of a rig, of its posts, beams, chain or starting
        height, of a condition, or one drop alone. Of several sessions see `DropModel.owners`.
    moves
        Which parameters of a side's trajectory it acts on, see `parameters`.
    path
        Their derivatives, of any shape that fits ``(parameters, members)``.
    level
        Derivatives of the levels of its expected edges, shape ``(edges, members)``.
    rate
        That of the time scale: how much later by it each moment is, relative.
    scale
        Of `rig.analysis.components.Components`, which multiplies the prior and which its members
        tell in turn.
    absent
        Share of its prior variance that is none where a prediction's equations hold.
    """

    name: str
    line: str
    sd: Callable[[Side], float | Sequence[float] | Array | None]
    of: Literal["all", "each", "impact", "free"] = "all"
    shared: Literal["rig", "posts", "beams", "start", "chain", "condition", "drop"] = "drop"
    moves: str = ""
    path: Effect = lambda _side: np.ones(1)
    level: Effect | None = None
    rate: float = 0.0
    scale: str = ""
    absent: Callable[[Side], float | Array] = lambda _side: 0.0

    def prior(self, side: Side) -> Array | None:
        """Prior standard uncertainties of its members where there are any, shape ``(members,)``."""
        sd = self.sd(side)
        if sd is None:
            return None
        scale = float(getattr(side.model.components, self.scale)) if self.scale else 1.0
        prior: Array = scale * np.atleast_1d(sd)
        return prior


def _by_gate(side: Side) -> Array:
    gates: Array = np.eye(len(side.gates.gates))[side.edges.gate]
    return gates


def _by_post(side: Side) -> Array:
    post = [gate.side == np.array(side.gates.posts) for gate in side.gates.gates]
    posts: Array = np.array(post, dtype=np.float64)[side.edges.gate]
    return posts


def _ripple_sd(side: Side) -> list[float] | None:
    return [side.steepest] * len(side.gates.gates) if side.steepest else None


def _rippled(side: Side) -> Array:
    """A beam is off by as much for a chain of less tilted rods, which shows less."""
    return -side.slope / side.steepest * side.edges.turn[:, None] * _by_gate(side)


def _swing_sd(side: Side) -> float | None:
    if side.protocol.surface is None or side.rods < 2:
        return None
    return swing_sd(side.record.chain.chain, side.protocol)


def _swung(side: Side) -> Array:
    """How much lower each rod is as it strikes."""
    levers = lever(side.record.chain.chain)
    return -drawn(levers, side.protocol, -side.record.strikes)[:, None]


def _impulse_sd(side: Side) -> Array:
    components: Components = side.model.components
    return components.impulses(side.alpha, above(side.record.chain.chain))


def _bounces(side: Side) -> Array:
    """Share of the variance of impulses that strings make by bouncing."""
    sd = _impulse_sd(side)
    bounces = side.model.components.bounce * side.alpha / above(side.record.chain.chain)
    # Zero where impulses are known exactly: then none bounce either.
    share: Array = np.divide(bounces, sd, out=np.zeros_like(sd), where=sd > 0.0) ** 2
    return share


def _top_sd(side: Side) -> float:
    """It falls on as it was off its chain while two were left."""
    components = side.model.components
    return math.sqrt(2.0) * math.hypot(components.departure, 0.5 * components.few)


def _stretch_sd(side: Side) -> list[float]:
    """A half of its variance is the same in all drops."""
    priors = side.protocol.priors
    size = priors.stretch * math.hypot(side.record.alpha, priors.impulse_floor)
    return [math.sqrt(0.5) * size * side.record.chain.chain.length] * MODES


def _late_sd(side: Side) -> float:
    """No edge tells it; where strings do not bounce, there is none."""
    priors = side.protocol.priors
    bounce = side.model.components.bounce / priors.last_impulse if priors.last_impulse else 1.0
    return bounce * priors.late_pull


def _unlike_air_sd(side: Side) -> float | None:
    """Of the κ of a chain unlike the first: widths alone do not tell of which wood each is."""
    more = abs(float(side.record.air[0]) - 1.0)
    stated = side.protocol.drag is not None or side.record.chain.weighed
    return None if stated or not more else more * side.model.kappa_u


def _lag_sd(side: Side) -> list[float] | None:
    unlike = any(record.unlike.any() for record in side.model.records.values())
    return [math.hypot(*prior_air(side.protocol))] * 2 if unlike else None


def _lag(side: Side) -> Array:
    return -lags(side.record, side.protocol.drop.value, side.edges.rods, side.edges.levels)


def _slack_sd(side: Side) -> list[float] | None:
    """Of a rod that one other holds, as of the top rod while two are left."""
    return [_top_sd(side)] * side.rods if side.record.unlike.any() else None


def _slack(side: Side) -> Array:
    return -slack(side.record, side.protocol.drop.value, side.edges.rods, side.edges.levels)


def _strike_sd(side: Side) -> float:
    """Where not all rods pass the lowest beams, the top rod may strike as high as these are."""
    lying = [side.gates.gates[train.gate].height for train in side.record.aside]
    return max([side.protocol.contact.strike.u, *lying])


def _contact(side: Side) -> Array:
    """Results are at the stated level: where the top rod would be if others struck elsewhere."""
    return np.append(-np.ones(side.rods - 1), 0.0)[:, None]


def _top(side: Side) -> Array:
    return np.append(np.zeros(side.rods - 1), 1.0)[:, None]


def _all(_: Side) -> float:
    return 1.0


_rig = partial(Unknown, shared="rig")
_beams = partial(Unknown, shared="beams")
_chain = partial(Unknown, of="each")
_struck = partial(Unknown, of="impact")
_stretch = partial(
    _struck,
    line="stretch",
    sd=_stretch_sd,
    level=lambda side: side.model.discrepancy.stretch,
    scale="stretch",
    absent=_all,
)

TABLE = (
    _rig("clock", "clock", lambda side: side.model.clock_u, rate=1.0),
    _rig(
        "gravity",
        "gravity",
        lambda side: None if side.protocol.surface is None else side.protocol.gravity.u,
        moves="gravity",
    ),
    Unknown(  # Where gravity is the result, each drop measures it for itself.
        "gravity",
        "gravity",
        lambda side: ANY_GRAVITY if side.protocol.surface is None else None,
        moves="gravity",
    ),
    Unknown(
        "drop", "drop height", lambda side: side.protocol.drop.u, shared="start", moves="start"
    ),
    _rig(
        "side",
        "side",
        lambda side: side.protocol.priors.side if len(side.model.records) > 1 else None,
        of="free",
        moves="start",
    ),
    _rig(
        "drag",
        "air",
        lambda side: side.model.kappa_u,
        moves="drag",
        absent=lambda side: float(side.protocol.drag is None),
    ),
    _chain(
        "air",
        "air",
        _unlike_air_sd,
        shared="chain",
        moves="drag",
        path=lambda side: 1.0 / side.record.air[:1],
        absent=_all,
    ),
    _rig("air lag", "air", _lag_sd, of="each", level=_lag, absent=_all),
    Unknown("free slack", "air", _slack_sd, of="free", shared="chain", level=_slack, absent=_all),
    Unknown(
        "datum",
        "datum",
        lambda side: [side.gates.datum_u] * len(side.gates.posts),
        shared="posts",
        level=_by_post,
    ),
    _beams(
        "beams",
        "beam heights",
        lambda side: [side.gates.height_u] * len(side.gates.gates),
        level=_by_gate,
        scale="gates",
    ),
    _beams("ripple", "beam offsets", _ripple_sd, level=_rippled, scale="beam"),
    _chain(  # Told by the edges alone, so its uncertainty counts as theirs.
        "release", "edges", lambda _: ANYTHING, moves="release"
    ),
    _chain("hang", "start height", _all, moves="start", scale="hang"),
    _chain(
        "rods",
        "spacing",
        lambda side: [side.record.chain.position_u] * side.rods,
        shared="chain",
        moves="places",
        path=lambda side: np.eye(side.rods),
        level=lambda side: -np.eye(side.rods)[side.edges.rods],
        scale="rods",
    ),
    _chain(
        "off centre",
        "beam offsets",
        lambda side: side.protocol.priors.off_centre * side.slope if side.steepest else None,
        level=lambda side: -side.edges.turn,
    ),
    _chain(
        "width",
        "width",
        lambda side: side.record.chain.width_u,
        shared="chain",
        level=lambda side: -side.edges.sign,
    ),
    _chain(
        "swing",
        "swing",
        _swing_sd,
        moves="places",
        path=_swung,
        level=lambda side: side.edges.drawn,
        scale="swing",
    ),
    _struck("alpha", "edges", lambda _: ANYTHING, moves="gains"),
    _struck(
        "impulses",
        "single impulses",
        _impulse_sd,
        moves="gains",
        path=lambda side: np.eye(side.rods),
        absent=_bounces,
    ),
    _struck(
        "contact",
        "contact",
        lambda side: side.protocol.contact.level.u,
        shared="condition",
        moves="places",
        path=_contact,
    ),
    _struck("strike", "contact", _strike_sd),
    _struck(
        "top",
        "top rod",
        _top_sd,
        moves="places",
        path=_top,
        level=lambda side: -side.edges.alone.astype(np.float64),
    ),
    _struck(
        "landed",
        "contact",
        lambda side: side.model.components.landed,
        level=lambda side: -side.edges.landed * side.edges.alone,
    ),
    _struck(
        "lying",
        "contact",
        lambda side: side.model.components.landed,
        level=lambda side: -side.edges.landed * ~side.edges.alone,
        absent=_all,
    ),
    _struck(
        "strings",
        "single impulses",
        lambda side: side.protocol.priors.strings * abs(side.record.alpha),
        shared="condition",
        moves="gains",
        path=lambda side: above(side.record.chain.chain)[:, None] ** -2.0,
        absent=_all,
    ),
    _stretch("stretch"),
    _stretch("usual stretch", shared="condition"),
    _struck("late", "late pull", _late_sd, absent=_all),
)
"""In the order of a drop's vector. `strike` and `late` act on results alone."""


class Unknowns:
    """Named blocks of one long vector of a drop's unknowns, as the table has them.

    All values are deviations from the nominal scene, so the prior mean is zero everywhere.

    Attributes
    ----------
    rows
        Of the table, by the name of the block: that of the row, after the role of the chain where
        each has its own.
    blocks
        Place of each block in the vector, by name.
    groups
        Blocks of each line of the uncertainty budget.
    sd
        Prior standard uncertainties, shape ``(unknowns,)``.
    rate
        Derivatives of the time scale, see `Unknown.rate`; likewise.
    """

    def __init__(self, model: DropModel) -> None:
        self.rows: dict[str, Unknown] = {}
        self.blocks: dict[str, slice] = {}
        self.groups: dict[str, list[slice]] = {}
        priors: list[Array] = []
        rates: list[Array] = []
        size = 0
        for name, row, side in _named(model):
            prior = row.prior(side)
            if prior is None:
                continue
            self.rows[name] = row
            self.blocks[name] = block = slice(size, size + prior.size)
            self.groups.setdefault(row.line, []).append(block)
            priors.append(prior)
            rates.append(np.full(prior.size, row.rate))
            size = block.stop
        self.sd: Array = np.concatenate(priors)
        self.rate: Array = np.concatenate(rates)

    def __len__(self) -> int:
        return self.sd.size

    def __getitem__(self, name: str) -> slice:
        return self.blocks[name]

    def __contains__(self, name: object) -> bool:
        """Whether anything of a block is unknown: what is known exactly is as if it were not."""
        block = self.blocks.get(str(name))
        return block is not None and bool(self.sd[block].any())


def _named(model: DropModel) -> Iterator[tuple[str, Unknown, Side]]:
    """Go through the rows for the chains that there are."""
    sides = {role: Side(model, record) for role, record in model.records.items()}
    for own, rows in groupby((*TABLE, *model.suspects), lambda row: row.of == "each"):
        if own:
            own_rows = [*rows]
            for role, side in sides.items():
                yield from ((f"{role} {row.name}", row, side) for row in own_rows)
        else:
            first = next(iter(sides.values()))
            for row in rows:
                if row.of == "all" or row.of in sides:
                    yield row.name, row, sides.get(row.of, first)


def parameters(struck: int) -> dict[str, slice]:
    """Return which parameters of a trajectory are what, for so many rods that strike."""
    places = {"release": RELEASE, "start": START, "gravity": GRAVITY, "drag": DRAG}
    spans = {name: slice(place, place + 1) for name, place in places.items()}
    ends = [COMMON, COMMON + struck, COMMON + 2 * struck]
    return spans | {"gains": slice(*ends[:2]), "places": slice(*ends[1:]), "all": slice(0, ends[2])}


class SideSlopes(NamedTuple):
    """What all unknowns of a drop do to one side, to which path and levels are linear in them.

    Attributes
    ----------
    path
        Derivatives of the trajectory's parameters, shape ``(parameters, unknowns)``.
    levels
        Derivatives of the levels of expected edges, shape ``(edges, unknowns)``.
    columns
        Unknowns that this side knows of, by their places in the drop's vector; first those that
        move its trajectory. Shape ``(columns,)``.
    moving
        How many do.
    clocks
        Which of the columns change the time scale.
    """

    path: Array
    levels: Array
    columns: Index
    moving: int
    clocks: Index


def side_slopes(model: DropModel, role: str) -> SideSlopes:
    """Put together what the rows of the table do to one side."""
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
    return SideSlopes(path, levels, columns, moving.size, np.flatnonzero(at.rate[columns]))


class SharedUnknowns:
    """One vector of everything that the drops of a session have in common.

    A chain's rods are the same whether it strikes or falls freely, which is what tells them from
    beam heights: chains change sides, beams do not.

    Attributes
    ----------
    blocks
        Place of each block in the vector, by name.
    rows
        Of the table, by the same names.
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
        """Where a drop's unknowns that are here too are, in its own vector and in this one."""
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
    """Return the names of a drop's common blocks in its own vector, by those they have for all."""
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

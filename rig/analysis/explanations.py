"""Why edges are not those of this protocol: faults of one kind each, weighed against each other.

A drop that cannot be read, or reads badly, is read again as if one thing were otherwise: a chain
longer or of more rods, another drop height, a post higher, the clock slow, two gates exchanged …
Each such protocol is judged by the same marginal likelihood as the stated one, with what the fault
costs beforehand: how improbable it is, and how wide the range of its size. Only a fault that beats
all others clearly is named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.chain_records import chain_records
from rig.analysis.identify import around_order, possible, read_side, well_read
from rig.analysis.pattern import guesses
from rig.protocol.protocol import Gates
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator, Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.analysis.identify import Reading
    from rig.protocol.protocol import Gate, Protocol, RodChain, Run
    from rig.records import Drop

CLEAR = math.log(100.0)
"""Log odds by which a fault must beat every other one, and the protocol as it is, to be named."""
RARE = math.log(100.0)
"""How many drops of a kind there are to one with some fault: what each of them costs beforehand."""
_MORE = 3  # rods by which a chain may differ
_HALVINGS = 5  # of the step in which a fault's size is sought
_NAMED = 3  # faults told where none is clear
_SOME = 0.6  # share of a side's expected edges without which nothing is tried
_NEAR = 0.02  # how far off the expected α may be, to count votes by
_VOTED = 0.8  # share of all expected edges that must vote for a fall with a fault
_TRIED = 4  # kinds whose size is sought: those that most edges vote for


class Premise(NamedTuple):
    """What a drop is read with."""

    protocol: Protocol
    run: Run
    hz: float


@dataclass(frozen=True)
class Fault:
    """One way in which a rig may differ from its protocol.

    Attributes
    ----------
    change
        The setting as it is with a fault of some size.
    words
        What to say of it, given size and standard uncertainty.
    sizes
        Tried at first; apart by no more than what a reading tolerates.
    steady
        Whether sizes between them count too, so that the best one is sought.
    """

    change: Callable[[Premise, float], Premise]
    words: Callable[[float, float], str]
    sizes: tuple[float, ...] = (0.0,)
    steady: bool = False


@dataclass(frozen=True)
class Explanation:
    """A fault that would explain a drop.

    Attributes
    ----------
    words
        With its size.
    log_odds
        Against the protocol as it is.
    whole
        Whether nearly all edges are read with it.
    """

    words: str
    log_odds: float
    whole: bool


class Explainer:
    """Reads one drop with one fault after another.

    Parameters
    ----------
    setting
        As stated.
    drop
        The raw record.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        How much everything scatters.
    """

    def __init__(
        self, setting: Premise, drop: Drop, clock_u: float, components: Components
    ) -> None:
        self.setting = setting
        self.drop = drop
        self.clock_u = clock_u
        self.components = components
        # A fault of one side leaves the other as it was, and many sizes are asked for twice.
        self._near = {
            record.role: around_order(setting.protocol, record)
            for record in chain_records(setting.protocol, setting.run, drop, setting.hz)
        }
        self._shares: dict[Hashable, tuple[int, int]] = {}
        self._readings: dict[Hashable, Reading | None] = {}

    def explain(self, faults: Sequence[Fault]) -> list[Explanation]:
        """Weigh faults; the likeliest first, and only those likelier than none."""
        if any(possible(one) < _SOME * one.expected for one in self._records(self.setting)):
            return []  # too few edges came for any fall
        voted = [(*self._votes(one), n) for n, one in enumerate(faults)]
        voted.sort(key=lambda one: -one[1])
        likely = [n for share, _, n in voted if share >= _VOTED][:_TRIED]
        if not likely:
            return []
        stated = sum(one.evidence for one in self._read(self.setting) if one is not None)
        found = []
        for n in likely:
            one = self._weighed(faults[n], stated)
            if one is not None and one.log_odds > 0.0:
                found.append(one)
        return sorted(found, key=lambda one: -one.log_odds)

    def _votes(self, fault: Fault) -> tuple[float, int]:
        """Best share of expected edges, and votes less edges without, over a fault's sizes."""
        found = [self._voted(fault.change(self.setting, size)) for size in fault.sizes]
        return max(share for share, _ in found), max(net for _, net in found)

    def _voted(self, setting: Premise) -> tuple[float, int]:
        """Share of the expected edges that vote for one fall, and votes less edges without."""
        votes = expected = 0
        for record in self._records(setting):
            key = _key(setting, record)
            if key not in self._shares:
                drop, gravity = setting.protocol.drop, setting.protocol.gravity.value
                tried = guesses(
                    record,
                    Quantity(drop.value),
                    gravity,
                    alphas=(record.alpha - _NEAR, record.alpha + _NEAR),
                    window=self._near[record.role],
                )
                self._shares[key] = tried[0].votes if tried else 0, record.expected
            votes += self._shares[key][0]
            expected += self._shares[key][1]
        return votes / max(1, expected), 2 * votes - expected

    def _records(self, setting: Premise) -> list[ChainRecord]:
        return chain_records(setting.protocol, setting.run, self.drop, setting.hz)

    def _read(self, setting: Premise) -> list[Reading | None]:
        found = []
        for record in self._records(setting):
            key = _key(setting, record)
            if key not in self._readings:
                self._readings[key] = read_side(
                    setting.protocol, record, self.clock_u, self.components
                )
            found.append(self._readings[key])
        return found

    def _evidence(self, fault: Fault, size: float) -> tuple[float, bool]:
        found = self._read(fault.change(self.setting, size))
        whole = all(one is not None and well_read(one) for one in found)
        return sum(one.evidence for one in found if one is not None), whole

    def _weighed(self, fault: Fault, stated: float) -> Explanation | None:
        ranked = sorted(
            fault.sizes, key=lambda size: -self._voted(fault.change(self.setting, size))[1]
        )
        size, (best, whole) = max(
            ((one, self._evidence(fault, one)) for one in ranked[:2]), key=lambda pair: pair[1]
        )
        u, width = 0.0, float(len(fault.sizes))
        occam = math.log(width)
        if fault.steady:
            step = abs(fault.sizes[1] - fault.sizes[0])
            size, best, whole, u = self._sought(fault, size, (best, whole), step)
            span = max(fault.sizes) - min(fault.sizes)
            occam = math.log(span / (math.sqrt(2.0 * math.pi) * u))
        log_odds = best - occam - RARE - stated
        return Explanation(fault.words(size, u), log_odds, whole)

    def _sought(
        self, fault: Fault, size: float, known: tuple[float, bool], step: float
    ) -> tuple[float, float, bool, float]:
        """Find the likeliest size and, by the curvature there, its standard uncertainty."""
        best, whole = known
        below = above = best
        for _ in range(_HALVINGS):
            step /= 2.0
            below, _ = self._evidence(fault, size - step)
            above, _ = self._evidence(fault, size + step)
            bend = 2.0 * best - below - above
            move = (
                0.5 * step * (above - below) / bend
                if bend > 0.0
                else math.copysign(step, above - below)
            )
            tried = size + float(np.clip(move, -2.0 * step, 2.0 * step))
            value, read = self._evidence(fault, tried)
            if value > best:
                size, best, whole = tried, value, read
            if 0.0 < bend < 2.0:
                break  # the step is about what the edges tell
        bend = max(2.0 * best - below - above, 1e-6)
        return size, best, whole, step / math.sqrt(bend)


def _key(setting: Premise, record: ChainRecord) -> Hashable:
    """Return what a side's reading depends on."""
    protocol = setting.protocol
    levels = b"".join(train.levels.tobytes() for train in record.trains)
    channels = tuple(train.edge.tobytes() for train in record.trains)
    return (
        record.role, levels, channels, setting.hz, protocol.drop.value, protocol.gravity.value,
    )  # fmt: skip


def explained(found: Sequence[Explanation], accused: Sequence[str] = ()) -> list[str]:
    """Put the weighed faults of a drop into words: the clear one, or what there is beside.

    Parameters
    ----------
    accused
        What is said where no fault is clear.
    """
    second = max([0.0, *(one.log_odds for one in found[1:])])
    if found and found[0].whole and found[0].log_odds - second > CLEAR:
        return [f"{found[0].words} (odds {_odds(found[0].log_odds - second)} to 1)"]
    if accused or not found:
        return [*accused]
    told = "; or ".join(one.words for one in found[:_NAMED])
    return [f"likeliest, but not clearly: {told}"]


def _odds(log_odds: float) -> str:
    return f"{math.exp(log_odds):.0f}" if log_odds < math.log(1e4) else "more than 10000"


def faults(protocol: Protocol, run: Run, suspect: Sequence[int]) -> list[Fault]:
    """All faults that a scene may have.

    Parameters
    ----------
    suspect
        Numbers of the gates that are looked at one by one, as those that see little of a chain.
    """
    assert protocol.gates is not None
    gates = protocol.gates.gates
    sides = list(dict.fromkeys(gate.side for gate in gates))
    found = [*_chain_faults(protocol, run), *_rig_faults()]
    if len(sides) > 1:
        found += [_post(side) for side in sides]
    found += [_gate_off(gates[n]) for n in suspect]
    found += [_exchange(gates, a, b) for a, b in combinations(suspect, 2)]
    return found


def _grid(limit: float, step: float) -> tuple[float, ...]:
    count = math.ceil(limit / step)
    return tuple(step * n for n in range(-count, count + 1) if n)


def _chain_faults(protocol: Protocol, run: Run) -> Iterator[Fault]:
    """Faults of each chain, of both where they are alike, and of their places."""
    names = {role: name for role, name in (("impact", run.impact), ("free", run.free)) if name}
    groups = [({name}, f"chain {name}") for name in names.values()]
    if len(names) > 1:
        groups.append((set(names.values()), "each chain"))
    for group, who in groups:
        one = protocol.chains[next(iter(group))]
        if one.chain.heights[-1] > 0.0:
            yield _length(group, who, one.chain.heights[-1])
        yield _rods(group, who, one.chain.rods)
    for role, name in names.items():
        if upside_down(protocol.chains[name]) is not None:
            yield _turned(name, role)
    if len(names) > 1 and protocol.unlike_chains:
        yield Fault(
            lambda setting, _: setting._replace(
                run=replace(setting.run, impact=setting.run.free, free=setting.run.impact)
            ),
            lambda _s, _u: f"chains {run.impact} and {run.free} hang on each other's side",
        )


def _length(names: set[str], who: str, top: float) -> Fault:
    return Fault(
        _with_chains(names, _stretched),
        lambda s, u: (
            f"{who} is {_size(s * top, u * top)} {'longer' if s > 0 else 'shorter'} than "
            "the protocol says"
        ),
        _grid(0.06, 0.008),
        steady=True,
    )


def _rods(names: set[str], who: str, rods: int) -> Fault:
    counts = tuple(float(n) for n in range(-_MORE, _MORE + 1) if n and rods + n >= 2)
    return Fault(
        _with_chains(names, _with_more),
        lambda n, _: f"{who} has {rods + round(n)} rods, not {rods} as the protocol says",
        counts,
    )


def _turned(name: str, role: str) -> Fault:
    return Fault(
        _with_chains({name}, lambda chain, _: upside_down(chain) or chain),
        lambda _size, _u: f"chain {name} hangs upside down on the {role} side",
    )


def _rig_faults() -> Iterator[Fault]:
    """Faults of everything that both chains share."""
    yield Fault(
        lambda setting, d: _protocol(
            setting,
            drop=Quantity(setting.protocol.drop.value + d, setting.protocol.drop.u),
        ),
        lambda d, u: (
            f"the chains hang {_size(d, u)} {'higher' if d > 0 else 'lower'} above the "
            "contact point than the protocol says"
        ),
        _grid(60e-3, 6e-3),
        steady=True,
    )
    yield Fault(
        lambda setting, c: _moved(setting, c, lambda _gate: True),
        lambda c, u: (
            f"all gates are {_size(c, u)} {'higher' if c > 0 else 'lower'} above the "
            "contact point than the protocol says"
        ),
        _grid(40e-3, 6e-3),
        steady=True,
    )
    yield Fault(
        lambda setting, e: setting._replace(hz=setting.hz * (1.0 - e)),
        lambda e, u: f"the timer's clock is {_share(e, u)} {'slow' if e > 0 else 'fast'}",
        _grid(0.05, 0.006),
        steady=True,
    )
    yield Fault(
        lambda setting, e: _protocol(
            setting,
            gravity=Quantity(
                setting.protocol.gravity.value * (1.0 + e), setting.protocol.gravity.u
            ),
        ),
        lambda e, u: (
            f"gravity is {_share(e, u)} {'more' if e > 0 else 'less'} than the protocol says"
        ),
        _grid(0.10, 0.012),
        steady=True,
    )


def _post(side: str) -> Fault:
    return Fault(
        lambda setting, c: _moved(setting, c, lambda gate: gate.side == side),
        lambda c, u: (
            f"the {side} side's post is {_size(c, u)} {'higher' if c > 0 else 'lower'} "
            "than the protocol says"
        ),
        _grid(40e-3, 6e-3),
        steady=True,
    )


def _gate_off(gate: Gate) -> Fault:
    return Fault(
        lambda setting, c: _moved(setting, c, lambda one: one.channel == gate.channel),
        lambda c, u: (
            f"{name_of(gate)} is {_size(c, u)} {'higher' if c > 0 else 'lower'} than the "
            "protocol says"
        ),
        _grid(40e-3, 5e-3),
        steady=True,
    )


def _exchange(gates: Sequence[Gate], a: int, b: int) -> Fault:
    def change(setting: Premise, _: float) -> Premise:
        found = list(gates)
        found[a] = replace(gates[a], channel=gates[b].channel)
        found[b] = replace(gates[b], channel=gates[a].channel)
        return _with_gates(setting, found)

    return Fault(change, lambda _s, _u: exchanged(gates[a], gates[b]))


def exchanged(one: Gate, other: Gate) -> str:
    """Say that two gates changed places."""
    return f"{name_of(one)} and {name_of(other)} are plugged in the wrong way round"


def name_of(gate: Gate) -> str:
    """Say which gate, so that one can find it."""
    return f"the gate on channel {gate.channel} ({gate.side} side, {gate.height * 1e3:g} mm)"


def _protocol(setting: Premise, **changes: object) -> Premise:
    return setting._replace(protocol=replace(setting.protocol, **changes))  # type: ignore[arg-type]


def _with_gates(setting: Premise, gates: Sequence[Gate]) -> Premise:
    assert setting.protocol.gates is not None
    return _protocol(setting, gates=replace(setting.protocol.gates, gates=tuple(gates)))


def _moved(setting: Premise, by: float, which: Callable[[Gate], bool]) -> Premise:
    gates = setting.protocol.gates
    assert isinstance(gates, Gates)
    return _with_gates(
        setting,
        [replace(one, height=one.height + by) if which(one) else one for one in gates.gates],
    )


def _with_chains(
    names: set[str], other: Callable[[RodChain, float], RodChain]
) -> Callable[[Premise, float], Premise]:
    def change(setting: Premise, size: float) -> Premise:
        chains = {
            name: other(chain, size) if name in names else chain
            for name, chain in setting.protocol.chains.items()
        }
        return _protocol(setting, chains=chains)

    return change


def _stretched(chain: RodChain, by: float) -> RodChain:
    heights = tuple(height * (1.0 + by) for height in chain.chain.heights)
    return replace(chain, chain=replace(chain.chain, heights=heights))


def _with_more(chain: RodChain, more: float) -> RodChain:
    """Add rods like the top one at the top, or take some off."""
    rods, extra = chain.chain, round(more)
    if extra < 0:
        kept = slice(0, rods.rods + extra)
        inertias = rods.inertias and rods.inertias[kept]
        less = replace(
            rods, masses=rods.masses[kept], heights=rods.heights[kept], inertias=inertias
        )
        return replace(
            chain, chain=less, widths=chain.widths[kept], diameters=chain.diameters[kept]
        )
    pitch = rods.heights[-1] - rods.heights[-2] if rods.rods > 1 else 0.0
    added = tuple(rods.heights[-1] + pitch * (n + 1) for n in range(extra))
    inertias = rods.inertias and rods.inertias + rods.inertias[-1:] * extra
    longer = replace(
        rods,
        masses=rods.masses + rods.masses[-1:] * extra,
        heights=rods.heights + added,
        inertias=inertias,
    )
    return replace(
        chain,
        chain=longer,
        widths=chain.widths + chain.widths[-1:] * extra,
        diameters=chain.diameters + chain.diameters[-1:] * extra,
    )


def upside_down(chain: RodChain) -> RodChain | None:
    """Turn a chain round; `None` where that makes no difference."""
    rods = chain.chain
    top = rods.heights[-1]
    heights = tuple(top - height for height in rods.heights[::-1])
    widths = chain.widths[::-1]
    alike = all(abs(a - b) < 1e-3 for a, b in zip(heights, rods.heights, strict=True))
    if alike and widths == chain.widths:
        return None
    inertias = rods.inertias and rods.inertias[::-1]
    turned = replace(rods, masses=rods.masses[::-1], heights=heights, inertias=inertias)
    return replace(chain, chain=turned, widths=widths)


def _size(metres: float, u: float) -> str:
    return f"{abs(metres) * 1e3:.1f} ± {max(2e3 * u, 0.1):.1f} mm"


def _share(share: float, u: float) -> str:
    return f"{abs(share):.2%} ± {max(2.0 * u, 1e-4):.2%}"

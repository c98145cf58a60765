"""The chosen reading against all readings there are."""

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import log_ndtr

from bench.studies.layout_catalogue import GateLayout, Kind, even
from rig.analysis.annealing import MISSED, STRAYS
from rig.analysis.identify import LEAD, deciding_gate, pattern_faults
from rig.protocol.protocol import Protocol
from rig.protocol.reader import parse
from rig.records import Edge
from sim.dials import Dials
from tests.analysis.drops import CLOCK_U, STATED, Case, case

# Every reading there is ---------------------------------------------------------------------------


SCATTERS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0)
MOST = 40  # readings of which anything is asked


def readings(edges: list[bool], expected: list[bool]) -> list[tuple[int, ...]]:
    """All ways to give each expected edge of a beam an edge of its polarity, or none, in order."""
    if not expected:
        return [()]
    found = [(-1, *rest) for rest in readings(edges, expected[1:])]
    for n, blocked in enumerate(edges):
        if blocked == expected[0]:
            later = readings(edges[n + 1 :], expected[1:])
            found += [(n, *(m + n + 1 if m >= 0 else -1 for m in rest)) for rest in later]
    return found


def log_likelihood(
    protocol: Protocol, times: np.ndarray, rods, blocks, gates, scatter: float = 1.0
) -> float:
    """Marginal likelihood of edges that are given to rods, in a fall from rest.

    `scatter` is how much more the edges scatter than stated.

    From where the fall is likeliest the equations are taken as linear: then heights at the edges'
    times are normal, with a covariance of edge errors and of everything that is not known.
    """
    chain = protocol.chains["A"]
    heights = np.array([gate.height for gate in protocol.gates.gates])
    places, half = np.array(chain.chain.heights), np.array(chain.widths) / 2.0
    levels = heights[gates] - places[rods] + np.where(blocks, half[rods], -half[rods])

    # Release, start, gravity; then one by one clock, beams, rods, width.
    sd = np.array([1.0, math.hypot(protocol.drop.u, STATED.hang), 5.0])
    release, start, gravity = 0.0, protocol.drop.value, protocol.gravity.value
    centre = np.array([release, start, gravity])
    value = centre.copy()
    constant = np.hstack(
        [
            protocol.gates.height_u * (gates[:, None] == np.arange(heights.size)),
            chain.position_u * (rods[:, None] == np.arange(places.size)),
            np.where(blocks, 0.5, -0.5)[:, None] * chain.width_u,
            np.full((rods.size, 1), protocol.gates.datum_u),
        ]
    )
    for _ in range(60):
        since = times - value[0]
        residual = value[1] - 0.5 * value[2] * since**2 - levels
        slopes = np.stack([value[2] * since, np.ones(times.size), -0.5 * since**2], axis=1)
        speed = np.abs(value[2] * since)
        noise = scatter**2 * (STATED.floor**2 + (speed * STATED.jitter) ** 2)
        clock = (-value[2] * since * times * CLOCK_U)[:, None]
        # Of κv² on the way; nothing falls so long that more terms count, but a step astray.
        air = (value[2] ** 2 * np.clip(since, 0.0, 0.5) ** 4 / 12.0)[:, None] * protocol.priors.drag
        rest = np.diag(noise) + constant @ constant.T + clock @ clock.T + air @ air.T
        weight = np.linalg.inv(rest)
        matrix = slopes.T @ weight @ slopes + np.diag(sd**-2.0)
        right = slopes.T @ weight @ residual + (value - centre) / sd**2
        step = np.linalg.solve(matrix, right)
        value = value - step
        if np.all(np.abs(step) < 1e-9):
            break
    if (since <= 0.0).any():
        return -math.inf
    covariance = rest + (slopes * sd**2) @ slopes.T
    far = residual + slopes @ (centre - value)
    _, volume = np.linalg.slogdet(2.0 * math.pi * covariance)
    # A density of heights; of times it is speed times as much.
    density = -0.5 * volume - 0.5 * far @ np.linalg.solve(covariance, far)
    density += np.log(np.maximum(speed, 0.05)).sum()
    # Air only holds back: what of the normal distribution of κ is below zero is not there.
    known = np.linalg.solve(covariance, air)[:, 0]
    kappa, spread = -known @ far, math.sqrt(1.0 - known @ air[:, 0])
    density += math.log(2.0) + log_ndtr(kappa / spread)
    return float(density + times.size * (math.log((1.0 - MISSED) / MISSED) - math.log(STRAYS)))


def oracle(one: Case, least: float = 0.5) -> list[tuple[float, float, dict[int, int]]]:
    """Every reading of a fence's edges, edge → rod, with its logarithm, the likeliest first.

    Beside it the logarithm at whatever scatter makes it likeliest. Left out is what gives a rod to
    less than the `least` share of the expected edges: no reading that explains so little is near.
    """
    (record,) = one.records
    edges, due = record.edges, record.due
    choices = []
    for gate in np.unique(due.gate).tolist():
        came, first = edges.gate == gate, int(np.searchsorted(edges.gate, gate))
        ways = readings(edges.blocked[came].tolist(), due.blocks[due.gate == gate].tolist())
        choices.append([[n + first if n >= 0 else -1 for n in way] for way in ways])
    found = []
    for choice in itertools.product(*choices):
        match = np.array([*itertools.chain(*choice)])
        seen, edge = match >= 0, match[match >= 0]
        if edge.size < least * record.edge_count:
            continue
        arrays = edges.times[edge], due.rods[seen], due.blocks[seen], due.gate[seen]
        given = dict(zip(edges.number[edge].tolist(), due.rods[seen].tolist(), strict=True))
        likely = log_likelihood(one.protocol, *arrays)
        found.append((likely, arrays, given))
    found.sort(key=lambda row: -row[0])
    return [
        (likely, max(log_likelihood(one.protocol, *arrays, s) for s in SCATTERS), given)
        for likely, arrays, given in found[:MOST]
    ]


def unlike(one: dict[int, int], other: dict[int, int]) -> bool:
    """Whether two readings differ in more than a stray in place of a missed edge."""
    changed = {edge for edge in one | other if one.get(edge) != other.get(edge)}
    return len(changed) > 2


def few_bars(rods: int, gates: list[int], drop_u: float = 2e-3) -> Protocol:
    kind = Kind("few bars", even(rods, 40 * (rods - 1), 15, 0), scene="fence")
    protocol = parse(GateLayout(kind, (), tuple(gates)).protocol())
    accept = replace(protocol.accept, missed_edges=0.15)
    return replace(protocol, drop=replace(protocol.drop, u=drop_u), accept=accept)


def spoiled(one: Case, missed: list[int], strays: list[tuple[float, bool]]) -> Case:
    """Without some edges, and with others at a share of the time between the first and last."""
    edges = list(one.drop.edges)
    first, last, gate = edges[0].tick, edges[-1].tick, one.protocol.gates.gates[0].channel
    kept = [edge for n, edge in enumerate(edges) if n not in missed]
    kept += [Edge(round(first + way * (last - first)), gate, dark) for way, dark in strays]
    return one.with_edges(kept)


CASES = {
    "two rods, one gate": (2, [60], [], [], 0.5),
    "three rods, two gates": (3, [30, 120], [], [], 0.8),
    "two rods, two gates, one missed": (2, [30, 150], [2], [], 0.5),
    "three rods, two gates, one missed and a stray": (3, [30, 120], [4], [(0.3, True)], 0.8),
    "four rods, one gate, a middle rod missed": (4, [60], [2, 3], [], 0.5),
}


def rods_in(drop, one) -> dict[int, int]:
    """The rod of every edge that was given to one, by its number in the drop."""
    return {n: rod for n, rod in enumerate(drop.rods_of(len(one.drop.edges))) if rod >= 0}


UNDISTURBED = Dials(bounce=0.0, missed=0.0, chatter=0.0, string=0.0)


@pytest.mark.parametrize("name", CASES)
def test_the_likeliest_of_all_readings_is_chosen(name):
    rods, gates, missed, strays, least = CASES[name]
    protocol = few_bars(rods, gates)
    one = spoiled(case(protocol, UNDISTURBED), missed, strays)
    (likeliest, _, given), *rest = oracle(one, least)
    found = one.identify()
    assert found.drop is not None
    assert rods_in(found.drop, one) == given
    # Laplace's method is exact for what is normal; a fall is, but for the noise's own slope.
    assert found.fit_reading().evidence == pytest.approx(likeliest, abs=0.01)
    others = [row for row in rest if unlike(row[2], given)]
    most = likeliest - max((row[0] for row in others), default=-math.inf)
    least_odds = likeliest - max((row[1] for row in others), default=-math.inf)
    # A reading that fits badly is given more scatter than is stated, which makes it likelier.
    if most < 2.0 * LEAD:
        assert least_odds - 0.1 < found.log_odds < most + 0.1
    else:
        # What is so unlikely need not be tried.
        assert found.log_odds > min(2.0 * LEAD, least_odds - 0.1)


def test_what_cannot_be_told_is_void_and_the_odds_are_stated():
    """One rod of three was missed, and nobody knows how high they hung: two falls, equally good."""
    protocol = few_bars(3, [60], 60e-3)
    one = spoiled(case(protocol, Dials.quiet()), [0, 1], [])
    (likeliest, _, given), *rest = oracle(one)
    odds = likeliest - max(log for log, _, other in rest if unlike(other, given))
    assert odds < math.log(3.0)
    found = one.identify()
    assert found.fit_reading().evidence == pytest.approx(likeliest, abs=0.01)
    assert found.log_odds == pytest.approx(odds, abs=0.1)
    assert any(
        reason.values["odds"] == math.exp(found.log_odds)
        for reason in pattern_faults(found).values()
    )
    assert [reason.code for reason in one.analyze().reasons] == ["two_falls"]
    read, other = (rods_in(drop, one) for drop in (found.drop, found.other))
    assert {*read.values()} != {*other.values()}


@pytest.mark.parametrize(("share", "code"), [(0.59, "few_edges_fit"), (0.61, "no_fall")])
def test_six_in_ten_edges_must_fit_a_fall(share, code):
    identified = SimpleNamespace(shares={"free": share}, drop=None)
    assert pattern_faults(identified)["free"].code == code


def test_a_further_gate_tells_what_one_cannot():
    """It is put where the two falls differ, and there the same drop is read."""
    protocol = few_bars(3, [60], 60e-3)
    found = spoiled(case(protocol, Dials.quiet()), [0, 1], []).identify()
    role, height = deciding_gate(found.drop, found.other)
    assert role == "free"
    two = few_bars(3, [60, round(height * 1e3)], 60e-3)
    whole = case(two, Dials.quiet())
    low = two.gates.gates[0].channel
    first = [n for n, edge in enumerate(whole.drop.edges) if edge.channel == low][:2]
    less = spoiled(whole, first, [])
    again = less.identify()
    assert again.log_odds > LEAD
    kept = [origin for n, origin in enumerate(whole.truth.edges) if n not in first]
    assert all(rod == kept[n][3] for n, rod in rods_in(again.drop, less).items())

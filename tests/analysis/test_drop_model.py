"""Observation equations and measurands: every derivative against finite differences."""

import math

import numpy as np
import pytest

from rig.analysis.adjust import adjust
from rig.analysis.departures import strike_u
from rig.analysis.drop_model import DropModel
from rig.analysis.equations import SHARED
from rig.analysis.quantities import measurands
from tests.analysis.drops import GRADED, SCENES, STATED, UNIFORM, case, with_dials

GAINS = ("alpha", "impulses", "strings")
"""Unknowns with a step of 1e-5; of the rest it is 1e-6 in m, s, m/s² and relative."""


def somewhere(x: np.ndarray, seed: int) -> np.ndarray:
    """A point near the true one, with every unknown off its nominal value."""
    return x + 0.2e-3 * np.random.default_rng(seed).normal(size=x.size)


def steps(model: DropModel) -> np.ndarray:
    found = np.full(len(model.unknowns), 1e-6)
    for name in GAINS:
        if name in model.unknowns:
            found[model.unknowns[name]] = 1e-5
    return found


def whole(equations, unknowns: int) -> np.ndarray:
    """Derivatives by all unknowns, also those of the other side."""
    found = np.zeros((equations.slopes.shape[0], unknowns))
    found[:, equations.columns] = equations.slopes
    return found


def differences(function, x: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Central differences, the unknowns along the last axis; and where there is a kink.

    The motion has a kink at each impact. An edge that comes within a step of one has two slopes.
    """
    here = function(x)
    columns, kinks = [], []
    for n, h in enumerate(step):
        shift = np.zeros_like(x)
        shift[n] = h
        after, before = function(x + shift), function(x - shift)
        columns.append((after - before) / (2 * h))
        kinks.append(np.abs(after - 2 * here + before) / h > 1e-3)
    return np.stack(columns, axis=-1), np.stack(kinks, axis=-1)


def stamped_as_expected(model: DropModel, matches: dict, x: np.ndarray) -> DropModel:
    """The same drop with every matched edge where these unknowns put it."""
    for _ in range(4):  # Newton's steps, from less than a millimetre
        shifts = {}
        for role, match in matches.items():
            left = model.residuals(role, x, match)
            shifts[role] = np.zeros(model.records[role].edges.times.size)
            shifts[role][match[match >= 0]] = left.values / left.speed
        model = model.shaken(shifts)
    return model


def beyond_strikes(model, role, x, match):
    """How far from the nearest strike each edge is, in uncertainties of where rods strike.

    Near a strike derivatives are means of both legs'; see `test_trajectory`.
    """
    path, record = model.trajectory(role, x), model.records[role]
    pick = np.flatnonzero(match >= 0)
    if record.ratios is None:
        return np.full(pick.size, np.inf)
    heights, _ = path.heights(model.records[role].edges.times[match[pick]] * model.rate(x))
    places = model.slopes[role].path[-record.ratios.size :]
    u = np.sqrt(places**2 @ model.unknowns.sd**2)
    off = (np.abs(heights[:, None] - path.height[1:]) / u).min(axis=1)
    return np.minimum(off, np.insert(off[:-1], 0, np.inf))  # for the second edge of a rod


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("seed", [1, 2])
def test_the_jacobian_is_the_derivative_of_the_residuals(scene, seed):
    """Where edges are stamped when they are expected; an error of a stamp must not change it."""
    noisy, matches, x = case(SCENES[scene], seed=seed).model()
    x = somewhere(x, seed)
    model = stamped_as_expected(noisy, matches, x)
    assert model.unknowns.sd.size == len(model.unknowns) == x.size
    moving = np.zeros(x.size, dtype=np.bool_)
    for role, match in matches.items():
        found = model.equations(role, x, match)
        assert found.residuals.values.size > 0.9 * model.records[role].edge_count
        expected, kinks = differences(
            lambda at, role=role, match=match: model.residuals(role, at, match).values,
            x,
            steps(model),
        )
        # The second edge of a rod says what the first one does not; see `Equations.told`.
        expected[1:] -= found.told[1:, None] * expected[:-1]
        kinks[1:] |= kinks[:-1] & (found.told[1:, None] > 0.0)
        # Heights near 1 m are rounded to 1e-16 m, over steps of 1e-6: 1e-10 of rounding; the
        # third derivatives (m/s³ and below 1e3) times the step squared are less.
        assert kinks.sum() <= 4
        smooth = ~kinks & (beyond_strikes(model, role, x, match) > 4.0)[:, None]
        assert smooth.mean() > 0.5
        jacobian = whole(found, x.size)
        np.testing.assert_allclose(jacobian[smooth], expected[smooth], rtol=1e-7, atol=2e-9)
        moving |= (jacobian != 0.0).any(axis=0)
    idle = {name for name in model.unknowns.blocks if not moving[model.unknowns[name]].any()}
    assert idle == ({"strike", "late"} if "impact" in model.records else set())


@pytest.mark.parametrize("scene", ["uniform", "fence"])
def test_a_stamp_s_own_error_tells_nothing_of_the_clock(scene):
    """All lengths by λ² and all times by λ are the same stamps: g ties the two together.

    With derivatives taken where an edge was stamped, each residual r changes by 2r on that way,
    and the errors of all edges together pull at the clock.
    """
    model, matches, x = case(SCENES[scene], with_dials(jitter_sd=2e-5), seed=4).model()
    x = adjust(model, matches, x).x
    at, protocol = model.unknowns, model.protocol
    for role, record in model.records.items():
        scaled = np.zeros(x.size)
        scaled[at["clock"]] = 1.0 + x[at["clock"]]
        scaled[at[f"{role} release"]] = model.trajectory(role, x).time[0]
        scaled[at["drop"]] = 2.0 * model.trajectory(role, x).height[0]
        scaled[at["beams"]] = [2.0 * gate.height for gate in protocol.gates.gates]
        scaled[at["beams"]] += 2.0 * x[at["beams"]]
        scaled[at["datum"]] = 2.0 * x[at["datum"]]
        scaled[at[f"{role} rods"]] = 2.0 * np.array(record.chain.chain.heights)
        scaled[at[f"{role} rods"]] += 2.0 * x[at[f"{role} rods"]]
        scaled[at[f"{role} width"]] = 2.0 * (record.chain.widths[0] + x[at[f"{role} width"]])
        powers = {"ripple": 2.0, "drag": -2.0, "contact": 2.0, "top": 2.0, f"{role} swing": 2.0}
        powers |= dict.fromkeys(("landed", "lying", "stretch", "turned", "usual stretch"), 2.0)
        powers |= {f"{role} off centre": 2.0}
        for name, power in powers.items():
            if name in at:
                scaled[at[name]] = power * x[at[name]]
        found = model.equations(role, x, matches[role])
        off = np.abs(found.residuals.values).max()
        assert off > 2e-5  # of 20 µs at a metre a second and more
        assert np.abs(whole(found, x.size) @ scaled).max() < 1e-3 * off


@pytest.mark.parametrize("scene", SCENES)
def test_measurands_have_the_gradients_that_their_uncertainty_is_made_of(scene):
    model, _, x = case(SCENES[scene], seed=3).model()
    x = somewhere(x, 3)

    expected, kinks = differences(
        lambda at: np.array([one.value for one in measurands(model, at).values()]), x, steps(model)
    )
    assert not kinks.any()
    gradients = np.stack([one.slopes for one in measurands(model, x).values()])
    np.testing.assert_allclose(gradients, expected, rtol=1e-7, atol=2e-9)


def test_edges_scatter_as_early_strikes_make_rods_late():
    """A strike is off by half its u on average, and costs a rod half of its speed."""
    model, *_ = case(UNIFORM).model()
    record, edges = model.records["impact"], model.expected["impact"]
    ways, some = edges.levels + record.strikes[edges.rods], np.flatnonzero(edges.rods == 12)[:6]
    off = 0.5 * strike_u(record, UNIFORM)[12]
    late = 0.5 * np.random.default_rng(1).laplace(-ways[some], off, (200_000, 6)).clip(min=0.0)
    np.testing.assert_allclose(edges.landed[some], np.sqrt(np.mean(late**2, axis=0)), rtol=0.1)


def test_a_beam_off_the_middle_counts_as_the_rods_are_tilted():
    """A beam a millimetre off the middle sees a tilted rod that much higher or lower: x tan φ."""
    for protocol, tilt in ((UNIFORM, 12.0), (GRADED, 21.0)):
        model, _, _ = case(protocol).model()
        ripple = model.unknowns.sd[model.unknowns["ripple"]]
        assert ripple == pytest.approx([1e-3 * math.tan(math.radians(tilt))] * 16)


def test_an_edge_is_as_sure_as_the_chain_is_slow():
    """σ² = floor² + (V · jitter)², and a flicker is no better than it lasts.

    Once rods have struck, those that still fall may be off their chain, few further than many; the
    last one is the chain.
    """
    model, matches, x = case(UNIFORM, seed=3).model()
    for role, match in matches.items():
        found = model.residuals(role, x, match)
        record, edge = model.records[role], match[match >= 0]
        times, burst = record.edges.times[edge], record.edges.burst[edge]
        clock = x[model.unknowns["clock"]]
        _, speed = model.trajectory(role, x).heights(times * (1.0 + clock))
        rods = record.due.rods[match >= 0]
        hits = model.trajectory(role, x).time[1:]
        off = np.zeros(times.size)
        if role == "impact":
            last = (rods == hits.size - 1) & (times > hits[-2])
            left = hits.size - np.sum(times[:, None] > hits, axis=1)
            further = STATED.few / np.maximum(left, 1)
            off = np.where((times > hits[0]) & ~last, np.hypot(STATED.departure, further), 0.0)
            assert left[~last].min() == 2
            assert last.any()
        edges, seen = model.expected[role], match >= 0
        landed = math.sqrt(1.0 - SHARED) * edges.landed[seen]
        expected = [
            math.sqrt(STATED.floor**2 + v**2 * (STATED.jitter**2 + b**2) + d**2 + early**2)
            for v, b, d, early in zip(speed, burst, off, landed, strict=True)
        ]
        np.testing.assert_allclose(found.sigma, expected, rtol=1e-12)
        assert (burst > 0.0).any()

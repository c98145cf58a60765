"""What a layout is said to tell: against drops, better layouts, and arithmetic with 60 digits."""

import re
from dataclasses import fields, replace
from decimal import Decimal, localcontext

import numpy as np
import pytest

from rig.analysis.components import Components, priors
from rig.design.cases import BEAM, cases
from rig.design.forecast import Forecast, GateLayout, forecast
from rig.design.search import Room, better, score
from rig.design.trials import Trials, readable, trials
from rig.estimate.coefficients import best, coefficient_problem
from rig.estimate.hypotheses import model_alpha
from rig.estimate.quadratic_forms import merge_like
from rig.protocol import reader
from rig.protocol.protocol import Condition, Gate, Gates, Plan, Priors, Protocol
from rig.report.templates import sentence
from rig.vocabulary import OBJECT, TWO_CHAINS
from tests.analysis.drops import PROTOCOLS, SINGLE, UNIFORM
from tests.analysis.test_datum_board import from_board, raised
from tests.estimate.sessions import DIALS, analysis, forms
from tests.tables import protocol_text

INCLINES = (30.0, 50.0, 70.0)
TRUE = Components(
    floor=1e-6, hang=1e-4, beam=5e-4, departure=1e-6, impulse=0.02, impulse_floor=1e-6, bounce=1e-6,
    few=1e-6, landed=1e-6,
    gates=2 / 3,
)  # fmt: skip
"""What the simulation's default dials are, in the analysis' words."""


def placed(protocol: Protocol, heights: list[float], **plan) -> Protocol:
    """The protocol with one side's beams elsewhere."""
    gates = tuple(Gate(n, height, "impact") for n, height in enumerate(heights))
    return replace(
        protocol, gates=Gates(gates, protocol.gates.height_u), plan=replace(protocol.plan, **plan)
    )


def foretold(protocol: Protocol, components: Components, *names: str) -> Forecast:
    """What the protocol's own beams will tell."""
    return forecast(protocol, GateLayout.of(cases(protocol, components)), names or None)


@pytest.fixture(scope="module")
def expected():
    """The forecast for the simulated session: its coefficients, its plan, the scatter it taught."""
    surface = UNIFORM.surface
    true = replace(
        surface,
        restitution=replace(surface.restitution, value=DIALS.restitution),
        friction=replace(surface.friction, value=DIALS.friction),
    )
    protocol = replace(UNIFORM, surface=true, plan=Plan(INCLINES, 2))
    return foretold(protocol, analysis(INCLINES).joint.components)


def test_the_forecast_is_what_a_session_then_states(expected):
    """Same scatter, same plan: only edges that were missed are in one and not in the other."""
    for result in analysis(INCLINES).runs:
        for name, by_case in expected.single.items():
            case, stated = Condition(result.run.incline_deg), result.quantities[name].u
            assert by_case[case] == pytest.approx(stated, rel=0.1), name


def test_the_forecast_of_coefficients_is_what_the_estimate_then_states(expected):
    found = best(UNIFORM, coefficient_problem(UNIFORM, merge_like(forms(INCLINES))))
    assert set(expected.coefficients) == {"restitution", "friction"}
    for name, u in expected.coefficients.items():
        assert u == pytest.approx(found[name].u, rel=0.2), name


LOW = placed(SINGLE, [0.02, 0.044, 0.056, 0.084])


def test_low_beams_alone_are_read_too():
    """No beam sees the chain before it strikes: what rods pass is enough to tell the fall."""
    assert readable(LOW)
    # Counted from the board, rods touch higher where it is steep.
    steep = from_board(raised(UNIFORM.text, 25.0)).replace("10 deg, 40 deg, 50", "60")
    assert readable(reader.parse(steep))
    assert trials(LOW, 6) == Trials(6, 6)


def test_trials_that_fail_name_the_side_and_a_gate():
    found = Trials(20, 13, (("free", 7),), ("free", 0.3))
    assert sentence("trials", found, TWO_CHAINS) == (
        "13 of 20 simulated trial drops were identified; unclear: free side (7); "
        "add a free gate at 300 mm"
    )
    assert "side" not in sentence("trials", found, OBJECT)


def test_proposals_respect_limits_and_are_never_worse():
    there = [0.06, 0.1, 0.35, 0.69]
    protocol = placed(SINGLE, there, repeats=4)
    limits = Room(0.02, 0.7, 0.03)
    found = better(protocol, TRUE, limits).gates.gates
    heights = [gate.height for gate in found]
    assert heights == sorted(heights)
    assert limits.lowest <= heights[0]
    assert heights[-1] <= limits.highest
    assert min(np.diff(heights)) >= limits.spacing - 1e-9
    hanging = 0.18 + np.array(protocol.chains["A"].chain.heights)
    moved = [h for h in heights if h not in there]
    assert all(np.abs(hanging - h).min() >= 0.0127 / 2 for h in moved)
    assert heights[0] < there[0]  # V shows below the last rod gap
    every = cases(protocol.with_gates([*protocol.gates.gates, *found]), TRUE)
    before, after = (GateLayout.of(every, range(n, n + 4)) for n in (0, 4))
    assert score(protocol, after) < score(protocol, before)
    now, then = (
        forecast(protocol, layout, ("speed_m_s",)).typical("speed_m_s")
        for layout in (before, after)
    )
    assert then < 0.7 * now


TEXT = protocol_text("three-rods")
PLAIN = reader.parse(TEXT)
EXACT = reader.parse(
    re.sub(r" ± [^,}\n]+", "", TEXT).replace("uncertainty: 0.3 mm", "uncertainty: 0 mm")
)
"""Nothing uncertain of the rig itself: heights, drop, gravity and coefficients."""


def scaled(factor: float, **changes: float) -> Priors:
    """Every prior so many times as wide."""
    names = (field.name for field in fields(Priors))
    wide = {name: factor * getattr(PLAIN.priors, name) for name in names}
    return Priors(**wide | changes)


SHARP = replace(PLAIN, priors=replace(PLAIN.priors, jitter=1e-12))
RIGS = {
    "sharp": (SHARP, 1e-9),
    "everything zero": (replace(EXACT, priors=scaled(0.0)), 1e-9),
    "every prior huge": (replace(PLAIN, priors=scaled(1e5, jitter=2e-6, strings=5e4)), 1e-4),
    "sharp, the air unknown": (replace(SHARP, priors=replace(SHARP.priors, drag=1e6)), 1e-9),
}
"""Protocols, and how sharp their edges are, m."""


def exact(values: np.ndarray) -> np.ndarray:
    """The same numbers as decimals, not one digit rounded."""
    return np.vectorize(Decimal, otypes=[object])(values)


def variances(slopes: np.ndarray, gradients: np.ndarray) -> list[Decimal]:
    """Variance of each row of gradients, priors of ±1 beside: by elimination in 60 digits."""
    size = slopes.shape[1]
    normal = slopes.T @ slopes + exact(np.eye(size))
    whole = np.column_stack([normal, gradients.T])
    for n in range(size):
        whole[n + 1 :] -= np.outer(whole[n + 1 :, n] / whole[n, n], whole[n])
    # With normal = LDLᵀ, g·normal⁻¹·g is the sum of (L⁻¹g)² over D.
    return [
        sum(whole[n, size + k] ** 2 / whole[n, n] for n in range(size))
        for k in range(gradients.shape[0])
    ]


@pytest.mark.parametrize("name", RIGS)
def test_no_digit_is_lost_to_sharp_edges_or_extreme_priors(name):
    protocol, floor = RIGS[name]
    beams, surface = protocol.gates.gates, protocol.surface
    kinds = cases(protocol, replace(priors(protocol), floor=floor))
    found = forecast(protocol, GateLayout.of(kinds))
    # All unknowns of the session: each drop's own and its α, what is common, beams.
    common = sum(case.own + case.struck for case in kinds)
    size, first, rows, at_alpha, gradients = (
        common + kinds[0].shared + BEAM * len(beams),
        0,
        [],
        [],
        [],
    )
    for case in kinds:
        place = np.append(first + np.arange(case.own + case.struck), common + case.here)
        at_alpha.append(first + case.own)
        first += case.own + case.struck
        for gradient in case.gradients.values():
            gradients.append(np.zeros(size))
            gradients[-1][place] = gradient
        for n, block in enumerate(case.blocks):
            beam = common + kinds[0].shared + BEAM * n + np.arange(BEAM)
            for slopes in block.slopes:
                rows.append(np.zeros(size))
                rows[-1][np.append(place, beam)[block.columns]] = slopes
    now = {"restitution": surface.restitution.value, "friction": surface.friction.value}
    chain = protocol.chains["A"].chain
    ties = [model_alpha(protocol, chain, case.run.incline_deg, now)[1] for case in kinds]
    with localcontext(prec=60):
        slopes = exact(np.array(rows))
        u = [float(x.sqrt()) for x in variances(slopes, exact(np.array(gradients)))]
        said = [
            found.single[quantity][protocol.condition(case.run)]
            for case in kinds
            for quantity in case.gradients
        ]
        assert said == pytest.approx(u, rel=1e-9)
        # With α by β and μ, of which no more is known than ±1.
        tied = np.column_stack(
            [np.delete(slopes, at_alpha, axis=1), slopes[:, at_alpha] @ exact(np.array(ties))]
        )
        wanted = exact(np.eye(tied.shape[1])[-2:])
        u = [float(x.sqrt()) for x in variances(tied, wanted)]
    # What is held is given without any prior; where one alone is, the other is given with it.
    assert found.held in (set(), set(now))
    assert [found.coefficients[name] for name in now] == pytest.approx(u, rel=1e-9)


def test_the_command_proposes_heights_and_writes_them(call, tmp_path):
    fence = PROTOCOLS / "picket-fence.yaml"
    new = tmp_path / "new.yaml"
    done = call("design", fence, "--lowest", "40 mm", "--spacing", "5 cm", "-o", new)
    (line,) = re.findall(r"^proposed \(mm\): (.*)$", done.out, re.MULTILINE)
    proposed = [float(one) * 1e-3 for one in line.split(", ")]
    told = float(re.findall(r"sweep \d: uncertainties × (\S+) in", done.err)[-1])
    (pair,) = re.findall(r"^g of one run .* (\S+) +(\S+)$", done.out, re.MULTILINE)
    assert told == pytest.approx(float(pair[1]) / float(pair[0]), rel=0.1)
    assert "±" not in done.out
    written, before = (
        [gate.height for gate in reader.read(path).gates.gates] for path in (new, fence)
    )
    assert sorted(written) == pytest.approx(sorted(proposed), abs=0.06e-3)
    assert written != before
    changed = [
        (old, now) for old, now in zip(fence.read_text("utf-8").splitlines(),
                                       new.read_text("utf-8").splitlines(), strict=True)
        if old != now
    ]  # fmt: skip
    assert 1 <= len(changed) <= len(proposed)
    assert all("height: " in old and "height: " in now for old, now in changed)
    call("design", fence, "--no-search", "-o", new, code=2)

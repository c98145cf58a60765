"""All drops fitted together: against all equations solved at once, and against the hidden truth."""

import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from rig.analysis import chain_records
from rig.analysis.budgets import Budgets
from rig.analysis.components import above
from rig.analysis.equations import STRAY, linearize
from rig.analysis.fit import alone as fit_alone
from rig.analysis.joint_fit import by_itself, joint_fit
from rig.analysis.quantities import measurands
from rig.analysis.result import GOOD
from rig.analysis.session import analyze
from rig.results.whole import complete_analysis
from rig.session.store import Session
from sim.lab import ChainLab
from tests.analysis.drops import UNIFORM, case
from tests.analysis.kept_results import FOLDER
from tests.analysis.sessions import MILD, analysis, cases, fit_session, fits

FOUR = (1, 2, 3, 4)
EIGHT = tuple(range(1, 9))


class Whole:
    """All equations of all drops in one matrix, nothing eliminated, in prior units."""

    def __init__(self, joint) -> None:
        size = len(joint.shared)
        self.columns = []
        for drop in joint.drops:
            place = np.empty(drop.x.size, dtype=int)
            place[drop.places.common] = drop.places.here
            place[drop.places.own] = size + np.arange(drop.places.own.size)
            size += drop.places.own.size
            self.columns.append(place)
        self.data = np.zeros((size, size))
        self.vector = np.zeros(size)
        self.x = np.zeros(size)
        self.group = np.empty(size, dtype=object)
        for drop, place in zip(joint.drops, self.columns, strict=True):
            sd = drop.model.unknowns.sd
            for rows in linearize(drop.model, drop.fitted, drop.x, cut=STRAY).rows.values():
                slopes, there = rows.slopes * sd[rows.columns], place[rows.columns]
                self.data[np.ix_(there, there)] += slopes.T @ slopes
                self.vector[there] += slopes.T @ rows.left
            self.x[place] = drop.model.unknowns.pull(drop.x)
            for name, row in drop.model.unknowns.rows.items():
                self.group[place[drop.model.unknowns[name]]] = row.line
        self.inverse = np.linalg.inv(self.data + np.eye(size))


# How far steps end from the solution, and sources' lines beside: a session's below 2 % of a
# standard uncertainty, a drop's that is fitted again from its end far below.
@pytest.mark.parametrize(
    ("name", "near", "line"),
    [("session", 2e-2, 5e-2), *((scene, 1e-6, 1e-5) for scene in ("uniform", "single", "fence"))],
)
def test_eliminating_drop_by_drop_is_solving_all_at_once(name, near, line):
    """The estimate is −C(Jᵀr − x₀): linear in the edges r and in the prior means x₀."""
    alone = None if name == "session" else fit_alone(fit_alone(fits(cases((1,), scene=name))[0]))
    joint = fit_session(FOUR) if alone is None else by_itself(alone)
    assert joint.settled
    whole = Whole(joint)
    size = len(joint.shared)
    left = whole.inverse @ (whole.vector + whole.x) / np.sqrt(np.diag(whole.inverse))
    assert np.abs(left).max() < 5.0 * near
    np.testing.assert_allclose(
        whole.inverse[:size, :size], joint.covariance, rtol=near, atol=1e-2 * near
    )
    for drop, place in zip(joint.drops, whole.columns, strict=True):
        found = Budgets(joint).measure_all(drop)
        for quantity, result in measurands(drop.model, drop.x).items():
            measured, full = found[quantity], np.zeros(whole.x.size)
            full[place] = result.slopes * drop.model.unknowns.sd
            influence = whole.inverse @ full
            assert measured.value == result.value
            assert measured.u == pytest.approx(math.sqrt(full @ influence), rel=near)
            assert measured.u == pytest.approx(math.hypot(*measured.budget.values()), rel=1e-9)
            assert (measured.shared is None) == (alone is not None)
            assert alone or math.hypot(*measured.shared) < measured.u
            for group in set(whole.group):
                part = np.linalg.norm(influence[whole.group == group])
                if group == "edges":
                    part = math.hypot(part, math.sqrt(influence @ whole.data @ influence))
                assert measured.budget.get(group, 0.0) == pytest.approx(
                    part, rel=line, abs=1e-3 * near * measured.u if alone else 1e-3 * measured.u
                )


def test_how_many_drops_are_fitted_at_once_changes_no_result(monkeypatch):
    """Drops of one condition: all in an array, or each in its own; also once it was forgotten."""
    together = fit_session(FOUR)
    monkeypatch.setattr("rig.analysis.joint_step._AT_ONCE", 1)
    chain_records._blank_records.cache_clear()
    each = joint_fit(fits(cases(FOUR)))
    for pair in zip(each.drops, together.drops, strict=True):
        assert len({drop.model.condition for drop in pair}) == 1
        one, other = (
            Budgets(fit).measure_all(drop) for fit, drop in zip((each, together), pair, strict=True)
        )
        for name, value in one.items():
            assert value.value == pytest.approx(other[name].value, abs=1e-3 * value.u), name
            assert value.u == pytest.approx(other[name].u, rel=1e-3), name


def test_more_rounds_change_no_result(monkeypatch):
    """Scatter that the drops determine poorly creeps: what looks at rest may be far from it."""
    with Session.open(FOLDER / "unlike.session", readonly=True) as session:
        usual = complete_analysis(session)
        monkeypatch.setattr("rig.analysis.joint_fit._DONE", 5e-3)
        longer = complete_analysis(session)
    assert not usual.unsettled
    assert not longer.unsettled
    for run, other in zip(usual.runs, longer.runs, strict=True):
        for name, value in run.quantities.items():
            assert abs(value.value - other.quantities[name].value) < 0.5 * value.u, name


def test_a_drop_without_any_edge_of_a_chain_harms_no_other():
    """As where edges that fit a drop by itself fit none of its rods any more."""
    first, *others = fits(cases(FOUR))
    bare = replace(first, matches=first.matches | {"free": 0 * first.matches["free"] - 1})
    joint = joint_fit([bare, *others])
    assert [np.isfinite(drop.x).all() for drop in joint.drops] == [True] * 4  # none if unsettled


# χ² of the members, at 1 in 10⁴ each side; what an estimate of a standard deviation may be off.
CHANCE = {"gates": 2.2, "rods": 1.5, "beam": 2.2, "hang": 2.1, "impulse": 1.3, "jitter": 1.05}


def test_how_much_everything_scatters_is_found_whatever_was_stated():
    """Twice as much as is stated."""
    dials = replace(
        MILD, gate_sd=0.4e-3, rod_sd=0.6e-3, beam_sd=1e-3, hang_sd=0.2e-3, impulse_sd=0.08,
        jitter_sd=4e-6,
    )  # fmt: skip
    components = fit_session(EIGHT, dials, 2).components
    # All at 60°, where α is 0.0689: only the sum of both parts shows.
    found = asdict(components) | {
        "impulse": components.impulses(0.0689119616602868, above(UNIFORM.chains["A"].chain))[0]
        / 0.0689
    }
    true = {
        "gates": dials.gate_sd / UNIFORM.gates.height_u,
        "rods": dials.rod_sd / UNIFORM.chains["A"].position_u,
        "beam": dials.beam_sd, "hang": dials.hang_sd, "jitter": dials.jitter_sd,
        "impulse": dials.impulse_sd,
    }  # fmt: skip
    for name, chance in CHANCE.items():
        assert true[name] / chance < found[name] < true[name] * chance, name
    assert found["floor"] < 5e-6  # the simulation has no scatter of this kind


def test_the_rod_maps_the_beams_and_the_air_are_the_rig_s():
    """Each found within its own uncertainty, and the odd rods' places far better than stated."""
    dials = replace(MILD, drag=0.03)
    joint = fit_session(EIGHT, dials, 3)
    lab = ChainLab(UNIFORM, dials, 3)
    u = np.sqrt(np.diag(joint.covariance)) * joint.sd
    truth = {
        f"{name} rods": body.offsets - np.array(body.spec.chain.heights)
        for name, body in lab.bodies.items()
    }
    truth["drag"] = np.array([dials.drag])
    truth["beams"] = np.array([lab.heights[g.channel] - g.height for g in UNIFORM.gates.gates])
    for name, true in truth.items():
        block = joint.shared.blocks[name]
        assert np.abs(joint.x[block] - true).max() < 4.0 * u[block].max(), name
    a = joint.shared.blocks["A rods"]
    error = np.diff((joint.x[a] - truth["A rods"])[::2])
    assert np.sqrt(np.mean(error**2)) < 0.02e-3  # of 0.3 mm stated, whatever the level
    block = joint.shared.blocks["A width"]
    width = lab.bodies["A"].widths[0] - UNIFORM.chains["A"].widths[0]
    assert abs(joint.x[block][0] - width) < 4.0 * u[block][0]


def test_the_least_sure_calibration_counts_for_all():
    drops = cases(FOUR)
    unsure = drops[0].scale._replace(u=1e-4)

    def mixed(drop):
        return drops[0].scale if drop.run == 4 else unsure

    raw = [one.drop for one in drops]
    found, expected = (analyze(UNIFORM, raw, scale).runs for scale in (mixed, lambda _: unsure))
    for one, other in zip(found, expected, strict=True):
        for name, measured in one.quantities.items():
            assert abs(measured.value - other.quantities[name].value) < 0.05 * measured.u
            assert measured.u == pytest.approx(other.quantities[name].u, rel=0.02)


def test_a_drop_that_does_not_go_with_the_others_stays_by_itself():
    """Somebody pushed the gates before the last drop: no place of a beam goes with all of them."""
    gates = UNIFORM.gates.gates
    pushed = [
        replace(gate, height=gate.height + (-1) ** n * 1.2e-3) for n, gate in enumerate(gates)
    ]
    other = UNIFORM.with_gates(pushed)
    rest = cases(FOUR)
    last = replace(case(other, MILD, run=5), protocol=UNIFORM)
    alone = last.analyze()
    assert (alone.verdict, alone.reasons) == ("accepted", ())
    found = analysis([*rest, last])
    assert [result.learned for result in found.runs] == [True] * 4 + [False]
    assert found.runs[-1].quantities == alone.quantities
    assert found.runs[-1].verdict == "accepted"
    assert found.runs[-1].reasons[0].code == "differs_from_session"
    without = analysis(rest)
    for one, other in zip(found.runs[:-1], without.runs, strict=True):
        assert one.quantities == other.quantities


def test_a_release_near_the_limit_is_judged_by_what_all_runs_say_of_it():
    drops = cases(FOUR)
    runs = analysis(drops).runs
    latest = max(runs, key=lambda one: abs(one.alone["release_skew_s"].value))
    sizes = [abs(each["release_skew_s"].value) for each in (latest.alone, latest.quantities)]
    # The limit lies between what the drop says by itself and what it says among all.
    scene = replace(UNIFORM, accept=replace(UNIFORM.accept, release_skew=sum(sizes) / 2.0))
    n = runs.index(latest)
    alone = replace(drops[n], protocol=scene).analyze()
    among = analysis(drops, scene)
    assert (alone.verdict in GOOD) is (sizes[0] < sizes[1])
    assert (among.runs[n].verdict in GOOD) is (sizes[1] < sizes[0])
    assert ((latest.run.number, 1) in among.adjusted) is (sizes[1] < sizes[0])
    assert among.runs[n].learned

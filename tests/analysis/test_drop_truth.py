"""Whole drops against the simulation's hidden truth."""

import math
from dataclasses import replace
from itertools import cycle

import pytest

from rig.protocol.protocol import Drag
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import (
    HZ,
    SCENES,
    STATED,
    UNIFORM,
    assert_true,
    case,
    with_dials,
    wrong_rods,
)
from tests.analysis.test_datum_board import BOARD, BOARD_GRADED
from tests.scenes.draw import scene

PLACES = [("uniform", angle) for angle in (0.0, 20.0, 40.0, 60.0, 80.0)]
PLACES += [("graded", None), ("single", None), ("fence", None)]
BOARDS = [("board", 40.0), ("board, graded", 40.0)]
ALL = SCENES | {"board": BOARD, "board, graded": BOARD_GRADED}
FASTEST = 8.1  # m/s, in any of these scenes


@pytest.mark.parametrize(("scene", "incline"), [*PLACES, *BOARDS])
def test_a_perfect_rig_measures_the_truth(scene, incline):
    """Only the rounding of times to ticks is left, which the budget lets one predict."""
    one = case(ALL[scene], Dials.quiet(), incline=incline, clock_u=0.0)
    result = one.analyze()
    assert (result.verdict, result.reasons, result.scatter) == ("accepted", (), 1.0)
    assert result.unmatched == ()
    assert result.json()["causes"] == []
    edges = len(one.drop.edges)
    assert result.audit.json() == {
        "received": edges, "matched": edges, "missed": 0, "spurious": 0, "lost": 0,
    }  # fmt: skip
    assert result.matches == {n: edge[3] for n, edge in enumerate(one.truth.edges)}
    # An estimate that is linear in the edges has, from edges that scatter by the floor, the line
    # `edges` of the budget; edges rounded to a tick scatter by tick/√12 times their speed instead.
    rounding = FASTEST / HZ / math.sqrt(12) / STATED.floor
    for name, measured in result.quantities.items():
        error = measured.value - getattr(one.truth, name)
        assert abs(error) < 5 * rounding * measured.budget["edges"], name
        assert 5 * rounding < 0.01


@pytest.mark.parametrize("seed", range(1, 16))
def test_any_scene_is_read(seed):
    """Rods from one to 60, alike or not, their α given or not; gates few or many, high or low."""
    drawn = scene(seed).protocol
    if not drawn.gates:
        return
    for dials, most in ((Dials.quiet(), 0.01), (Dials(skew_sd=1e-3), 1.0)):
        one = case(drawn, dials, seed=seed)
        result = one.analyze()
        assert (result.verdict, result.reasons) == ("accepted", ())
        assert not wrong_rods(result, one.truth)
        assert_true(result, one.truth, most)


def test_skew_is_found_with_its_sign_and_taken_out():
    """Free chain late: positive; Δz as it happened is larger by about 5 mm per ms."""
    quiet = case(UNIFORM, Dials.quiet(), incline=40.0).analyze().quantities
    for seed in (1, 2):
        one = case(UNIFORM, with_dials(skew_sd=2e-3), incline=40.0, seed=seed)
        found = one.analyze().quantities
        skew = one.truth.release_skew_s
        assert found["release_skew_s"].value == pytest.approx(skew, abs=0.5 / HZ)
        assert found["separation_m"].value == pytest.approx(
            quiet["separation_m"].value, abs=FASTEST / HZ
        )
        # While the skew lasts the free chain falls at g t: at t ≈ 0.5 s, 4.9 m/s.
        raw = found["separation_raw_m"].value - found["separation_m"].value
        fallen = found["fall_time_s"].value
        assert raw == pytest.approx(9.81 * skew * (fallen - skew / 2), abs=FASTEST / HZ)


@pytest.mark.parametrize(("scene", "error"), [*zip(SCENES, cycle([-4e-3, 4e-3]), strict=False)])
def test_a_wrong_clock_that_is_known_to_be_unsure_covers_the_truth(scene, error):
    """An uncalibrated resonator: ±0.5 %, taken as evenly likely between."""
    incline = 40.0 if scene == "uniform" else None
    one = case(SCENES[scene], Dials(skew_sd=1e-3, clock=error), incline=incline)
    result = replace(one, scale=one.scale._replace(hz=float(HZ), u=5e-3 / 3**0.5)).analyze()
    assert result.verdict == "accepted"
    assert not wrong_rods(result, one.truth)
    assert_true(result, one.truth)


@pytest.mark.parametrize("error", [5e-3, -5e-3])
def test_a_clock_said_to_be_better_than_it_is_does_not_pass_unseen(error):
    """Much of it looks like air, but no air gives a chain another gravity, and none pushes."""
    one = case(UNIFORM, Dials(skew_sd=1e-3, clock=error))
    result = replace(one, scale=one.scale._replace(hz=float(HZ))).analyze()
    assert result.verdict == "void"
    (reason,) = result.reasons
    faults = [reason.json(), *reason.values.get("candidates", ())]
    (values,) = (fault["values"] for fault in faults if fault["code"] == "clock")
    assert abs(-values["share"] - error) < values["U95"]
    assert f"% {'fast' if error > 0.0 else 'slow'}" in reason.text


def test_what_the_air_takes_is_told_by_the_free_chain():
    """A light chain loses a tenth of g: 50 mm at the end. Nothing else is told any worse for it."""
    drag = 0.08
    for seed, incline in ((1, 40.0), (2, 0.0)):
        one = case(UNIFORM, Dials(skew_sd=1e-3, drag=drag), incline=incline, seed=seed)
        result = one.analyze()
        assert result.verdict == "accepted", result.reasons
        assert not wrong_rods(result, one.truth)
        still = case(UNIFORM, Dials(skew_sd=1e-3), incline=incline, seed=seed).analyze()
        assert_true(result, one.truth)
        for name, measured in result.quantities.items():
            # What falls a tenth slower is told a tenth worse in time.
            assert measured.u == pytest.approx(still.quantities[name].u, rel=0.15), name


@pytest.mark.parametrize("scene", ["graded", "single", "fence"])
def test_stated_air_is_where_an_adjustment_begins(scene):
    """A terminal speed of 18 m/s, κ = 0.030/m: nobody need guess how much it may be."""
    alone = SCENES[scene]
    stated = replace(alone, drag=Drag(terminal_speed=Quantity(18.0, 0.5)))
    one = case(stated, Dials(skew_sd=1e-3))
    result, guessed = one.analyze(), replace(one, protocol=alone).analyze()
    assert result.verdict == "accepted", result.reasons
    assert_true(result, one.truth)
    for name, measured in result.quantities.items():
        assert measured.u < (0.5 if scene == "fence" else 1.1) * guessed.quantities[name].u

"""One object past several gates: acceleration, speed at each gate, time between them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rig.analysis.drop import fit_drop
from rig.analysis.gate_passages import _moment
from rig.analysis.session import analyze
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import PROTOCOLS, case

BALL, GLIDER = (reader.read(PROTOCOLS / f"{name}.yaml") for name in ("falling-ball", "glider"))
BOTH = pytest.mark.parametrize("protocol", [BALL, GLIDER], ids=["ball", "glider"])
QUIET = Dials.quiet()


def accelerated(result):
    (found,) = result.quantities.values()
    return found


def kappa(protocol):
    return protocol.gravity.value / 60.0**2 if protocol is BALL else 0.0


def speed_after(protocol, way):
    """v² = g (1 − e^(−2κd))/κ, and 2 g d without air."""
    air = kappa(protocol)
    square = -np.expm1(-2.0 * air * way) / air if air else 2.0 * way
    return np.sqrt(protocol.gravity.value * square)


def time_after(protocol, way):
    """ln cosh(√(κg) t) = κd, solved for the time."""
    air, g = kappa(protocol), protocol.gravity.value
    return np.arccosh(np.exp(air * way)) / np.sqrt(air * g) if air else np.sqrt(2.0 * way / g)


@BOTH
def test_without_disturbance_everything_is_as_it_fell(protocol):
    result = case(protocol, QUIET, run=1).analyze()
    assert result.verdict == "accepted"
    assert accelerated(result).value == pytest.approx(protocol.gravity.value, rel=1e-5)
    ways = [protocol.drop.value - one.height_m for one in result.gates]
    assert [one.channel for one in result.gates] == list(range(len(protocol.gates.gates)))
    for one, way in zip(result.gates, ways, strict=True):
        assert one.speed.value == pytest.approx(speed_after(protocol, way), rel=1e-5)
    assert result.gates[0].interval is None
    for one, (before, way) in zip(result.gates[1:], pairwise(ways), strict=True):
        lasted = time_after(protocol, way) - time_after(protocol, before)
        assert one.interval.value == pytest.approx(lasted, rel=1e-5)


@BOTH
def test_derivatives_at_a_gate_are_those_of_the_values(protocol):
    one = case(protocol, Dials(), run=1, seed=2)
    fit = fit_drop(protocol, one.run, one.drop, one.scale)[1]
    gate = protocol.gates.gates[2]
    here = _moment(fit.model, gate, fit.x)
    for at in np.flatnonzero(fit.model.unknowns.sd):
        step = 1e-4 * fit.model.unknowns.sd[at] * np.eye(fit.x.size)[at]
        low, high = (_moment(fit.model, gate, fit.x + way * step) for way in (-1.0, 1.0))
        width = 2.0 * step[at]
        assert (high.time - low.time) / width == pytest.approx(here.d_time[at], rel=1e-4, abs=1e-7)
        moved = (high.speed - low.speed) / width
        assert moved == pytest.approx(here.d_speed[at], rel=1e-4, abs=1e-6)


@BOTH
def test_intervals_hold_the_truth(protocol):
    """Of 40 rigs at 95 %: 33 or more, but for one of ten thousand sets."""
    found = [accelerated(case(protocol, Dials(), run=1, seed=n).analyze()) for n in range(1, 41)]
    assert sum(abs(one.value - protocol.gravity.value) <= one.expanded for one in found) >= 33


@BOTH
@pytest.mark.parametrize("share", [0.6, 0.9, 1.2])
def test_a_pull_far_from_the_stated_one_is_measured(protocol, share):
    """Friction, a slope that is not as stated: what such an experiment is for."""
    true = protocol.gravity.value * share
    one = case(replace(protocol, gravity=Quantity(true)), Dials(), run=1, seed=3)
    result = replace(one, protocol=protocol).analyze()
    assert result.verdict == "accepted"
    assert abs(accelerated(result).value - true) <= accelerated(result).expanded


def test_an_object_let_go_by_hand_needs_only_a_drop_that_is_known_less_well():
    one = case(replace(BALL, drop=Quantity(BALL.drop.value + 0.04)), Dials(), run=1, seed=3)
    wrong = replace(one, protocol=BALL).analyze()
    assert wrong.verdict == "void"
    assert any("it begins 40." in reason for reason in wrong.reasons)
    wide = replace(one, protocol=replace(BALL, drop=Quantity(BALL.drop.value, 0.05))).analyze()
    assert wide.verdict == "accepted"
    assert abs(accelerated(wide).value - BALL.gravity.value) <= accelerated(wide).expanded


def test_runs_are_averaged_gate_by_gate():
    cases = {run.number: case(BALL, Dials(), run=run.number, seed=1) for run in runs(BALL)}
    drops = [one.drop for one in cases.values()]
    # One run in which the second gate saw nothing: two intervals less.
    first = drops[0]
    drops[0] = replace(first, edges=tuple(edge for edge in first.edges if edge.channel != 1))
    found = analyze(BALL, drops, lambda drop: cases[drop.run].scale)
    (line,) = found.summary
    seen = [one for run in found.runs for one in run.gates if one.channel == 2]
    at = {one.mean.channel: one for one in line.gates}
    assert list(at) == [0, 1, 2, 3]
    assert (at[1].n, at[2].n) == (line.n - 1, line.n)
    assert at[2].speed_sd == pytest.approx(np.std([s.speed.value for s in seen], ddof=1))
    since = [one.interval.value for one in seen if one.interval is not None]
    assert len(since) == line.n - 1
    assert at[2].mean.interval.value == pytest.approx(np.mean(since))
    assert at[2].interval_sd == pytest.approx(np.std(since, ddof=1))

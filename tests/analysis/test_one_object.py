"""One object past several gates: acceleration, speed at each gate, time between them."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rig.analysis.gate_passages import moment
from rig.analysis.quantities import AdjustedDrop
from rig.protocol import reader
from rig.records import Edge
from rig.units import Quantity
from sim.dials import Dials
from tests.analysis.drops import PROTOCOLS, case

BALL, GLIDER = (reader.read(PROTOCOLS / f"{name}.yaml") for name in ("falling-ball", "glider"))
BOTH = pytest.mark.parametrize("protocol", [BALL, GLIDER], ids=["ball", "glider"])
QUIET = Dials.quiet()


@pytest.mark.parametrize("name", ["falling-ball", "glider", "picket-fence"])
def test_where_gravity_is_measured_none_need_be_stated(name):
    """The least that is measured on the ground is found all the same, and as surely."""
    text = re.sub(r"(?m)^(gravity|site):.*\n", "", (PROTOCOLS / f"{name}.yaml").read_text("utf-8"))
    there, unsaid = reader.parse(f"{text}gravity: 9.764 m/s^2\n"), reader.parse(text)
    assert unsaid.gravity != there.gravity
    drop = case(there, QUIET, run=1)
    wanted, found = drop.analyze(), replace(drop, protocol=unsaid).analyze()
    assert found.verdict == wanted.verdict == "accepted"
    (wanted,), (found,) = wanted.quantities.values(), found.quantities.values()
    assert found.value == pytest.approx(wanted.value, abs=0.01 * wanted.u)
    assert found.u == pytest.approx(wanted.u, rel=0.01)


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
    _, fit = case(protocol, Dials(), run=1, seed=2).read()
    gate = protocol.gates.gates[2]
    here = moment(AdjustedDrop(fit.model, fit.x), gate)
    for at in np.flatnonzero(fit.model.unknowns.sd):
        step = 1e-4 * fit.model.unknowns.sd[at] * np.eye(fit.x.size)[at]
        ends = [moment(AdjustedDrop(fit.model, fit.x + way * step), gate) for way in (-1.0, 1.0)]
        for value, low, high, least in zip(here, *ends, (1e-7, 1e-6), strict=True):
            moved = (high.value - low.value) / (2.0 * step[at])
            assert moved == pytest.approx(value.slopes[at], rel=1e-4, abs=least)


@BOTH
@pytest.mark.parametrize("share", [0.6, 1.2])
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
    (reason,) = (reason for reason in wrong.reasons if reason.code == "drop_height")
    assert abs(reason.values["size_m"] - 0.04) < reason.values["U95_m"]
    wide = replace(one, protocol=replace(BALL, drop=Quantity(BALL.drop.value, 0.05))).analyze()
    assert wide.verdict == "accepted"
    assert abs(accelerated(wide).value - BALL.gravity.value) <= accelerated(wide).expanded


LOWEST = BALL.gates.gates[-1]
ONE_GATE = BALL.with_gates([LOWEST])


def crossings(protocol, falls):
    """Edges of an object in free flight from rest, then after each bounce, until the last one.

    Without air. The floor is the zero of the heights; a fall is the speed (m/s) with which a flight
    begins there, the first one `None`.
    """
    g, start = protocol.gravity.value, protocol.drop.value
    half = next(iter(protocol.chains.values())).widths[0] / 2.0
    edges, began = [], 0.0
    for speed in falls:
        for gate in protocol.gates.gates:
            for level, inner in ((gate.height - half, False), (gate.height + half, True)):
                dark = not inner
                if speed is None:
                    edges.append((np.sqrt(2.0 * (start - level) / g), gate.channel, not dark))
                elif (square := speed**2 - 2.0 * g * level) > 0.0:
                    edges.append((began + (speed - np.sqrt(square)) / g, gate.channel, dark))
                    edges.append((began + (speed + np.sqrt(square)) / g, gate.channel, not dark))
        began += np.sqrt(2.0 * start / g) if speed is None else 2.0 * speed / g
    return edges


def imported(protocol, edges):
    """A drop of another timer's file, which knows no release."""
    one = case(protocol, QUIET, run=1)
    return replace(one, drop=replace(one.drop, fire_tick=None, certificate=None)).with_edges(
        Edge(round(when * one.scale.hz), channel, dark) for when, channel, dark in edges
    )


@BOTH
@pytest.mark.parametrize("gates", ["all", "one"])
@pytest.mark.parametrize("restitution", [0.95, 0.8])
def test_what_came_back_is_left_out_and_said_so(protocol, gates, restitution):
    """A ball that bounces, a glider that returns from the end of its track."""
    if gates == "one":
        lowest = min(protocol.gates.gates, key=lambda gate: gate.height)
        protocol = protocol.with_gates([lowest])
    protocol = replace(protocol, drag=None)
    arrival = np.sqrt(2.0 * protocol.gravity.value * protocol.drop.value)
    bounces = [arrival * restitution**n for n in (1, 2, 3)]
    result = imported(protocol, crossings(protocol, [None, *bounces])).analyze()
    once = imported(protocol, crossings(protocol, [None])).analyze()
    later = result.audit.received - once.audit.received
    assert later > 0
    assert result.verdict == once.verdict == "accepted"
    assert (result.audit.unexplained, result.audit.spurious) == (0, later)
    assert [reason.values for reason in result.reasons] == [{"edges": later}]
    assert accelerated(result).value == pytest.approx(accelerated(once).value, rel=1e-9)


@pytest.mark.parametrize("amplitude_deg", [10.0, 60.0])
def test_a_pendulum_is_no_fall(amplitude_deg):
    """Its bob passes the lowest point every half period, here as fast as the ball would fall."""
    g, width = BALL.gravity.value, next(iter(BALL.chains.values())).widths[0]
    speed = np.sqrt(2.0 * g * (BALL.drop.value - LOWEST.height))
    length = speed**2 / (2.0 * g * (1.0 - np.cos(np.radians(amplitude_deg))))
    half_period = np.pi * np.sqrt(length / g)
    edges = [
        (0.3 + n * half_period + late, LOWEST.channel, dark)
        for n in range(20)
        for late, dark in ((0.0, True), (width / speed, False))
    ]
    result = imported(ONE_GATE, edges).analyze()
    assert result.verdict == "void"
    assert result.audit.matched == 2
    assert result.audit.unexplained == 40 - 4  # the last one may be a turn in the beam

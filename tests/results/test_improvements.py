"""What a better measurement is promised to bring, beside what it brings."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rig.analysis.session import analyze
from rig.results.improvements import improvements
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case

PLAN = replace(UNIFORM.plan, inclines=(40.0,), repeats=12)
BETTER = {
    "datum": lambda gates: replace(gates, datum_u=gates.datum_u / 10.0),
    "beam heights": lambda gates: replace(gates, height_u=gates.height_u / 10.0),
}


def analysis(protocol):
    drops = [case(replace(UNIFORM, plan=PLAN), Dials(), seed=4, run=run) for run in range(1, 13)]
    return analyze(protocol, [one.drop for one in drops], lambda _: drops[0].scale)


@pytest.mark.parametrize("datum_u", [6e-4, pytest.param(3e-4, marks=pytest.mark.slow)])
def test_what_is_measured_better_brings_at_least_what_was_promised(datum_u):
    stated = replace(UNIFORM, plan=PLAN, gates=replace(UNIFORM.gates, datum_u=datum_u))
    summary = analysis(stated).summary
    promised = [one for one in improvements(summary) if one.line in BETTER]
    assert [one.line for one in promised] == ["datum"]
    for one in promised:
        name = one.measurand.name
        assert one.now == pytest.approx(summary[0].means[name].expanded)
        again = analysis(replace(stated, gates=BETTER[one.line](stated.gates))).summary
        # Scatter that was found moves a little with it.
        assert again[0].means[name].expanded < 1.02 * one.then < 1.02 * one.now
        assert one.sentence.startswith("If the ")
        assert one.json()["U95_at_most"] == one.then

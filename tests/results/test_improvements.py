"""What a better measurement is promised to bring, beside what it brings."""

from __future__ import annotations

from dataclasses import replace

from rig.analysis.session import analyze
from rig.results.improvements import improvements
from sim.dials import Dials
from tests.analysis.drops import UNIFORM, case

PLAN = replace(UNIFORM.plan, inclines=(40.0,), repeats=8)


def analysis(protocol):
    drops = [case(replace(UNIFORM, plan=PLAN), Dials(), seed=4, run=run) for run in range(1, 9)]
    return analyze(protocol, [one.drop for one in drops], lambda _: drops[0].scale)


def test_what_is_measured_better_brings_at_least_what_was_promised():
    stated, better = (
        replace(UNIFORM, plan=PLAN, gates=replace(UNIFORM.gates, datum_u=u)) for u in (6e-4, 6e-5)
    )
    summary = analysis(stated).summary
    (promised,) = (one for one in improvements(summary) if one.line in {"datum", "beam heights"})
    name = promised.measurand.name
    assert (promised.line, promised.now) == ("datum", summary[0].means[name].expanded)
    (again,) = analysis(better).summary
    # Scatter that was found moves a little with it.
    assert again.means[name].expanded < 1.02 * promised.then < 1.02 * promised.now
    assert promised.sentence.startswith("If the ")
    assert promised.json()["U95_at_most"] == promised.then

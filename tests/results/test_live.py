"""The live analysis says what the whole one does, and what a better input would bring."""

import math
import shutil
from dataclasses import replace

import pytest

from rig.analysis import identify
from rig.analysis.comparison import compare
from rig.analysis.distributions import coverage_factor
from rig.analysis.drop import DropCase
from rig.analysis.joint_fit import FEWEST
from rig.analysis.result import Measured
from rig.analysis.session import analyze
from rig.analysis.summary import Incline
from rig.clock.calibration import TimeScale
from rig.protocol.protocol import Condition
from rig.reasons import make_reason, plain_reason
from rig.results.blind import veiled_drop
from rig.results.improvements import improvements
from rig.results.known_drops import KnownDrops
from rig.results.live import LiveAnalysis
from rig.results.whole import complete_analysis, results
from rig.session.schema import RunState
from rig.session.store import Session
from tests.analysis.drops import UNIFORM, case
from tests.analysis.kept_results import FOLDER


@pytest.fixture
def session(tmp_path):
    """Eight drops, each four of them a block of A, B, B, A."""
    return shutil.copy(FOLDER / "unlike.session", tmp_path / "copy.session")


def reject(path, *runs):
    with Session.open(path) as session:
        for run in runs:
            session.add_state(run, 1, RunState.REJECTED, 0, (plain_reason("a draught"),))
        session.commit()


def whole(path):
    with Session.open(path, readonly=True) as session:
        return complete_analysis(session)


@pytest.mark.parametrize("rejected", [(6,), (2, 3, 4, 5, 6, 7, 8)])
def test_all_drops_together_say_what_rig_analyze_says(session, rejected):
    """Of one good drop alone nothing is fitted jointly; that is summed up likewise."""
    reject(session, *rejected)
    live = LiveAnalysis(session)
    view = live.read()
    assert view.lagging == (8 - len(rejected) >= FEWEST)
    if view.lagging:
        alone = view.analysis.summary
        live.fit_jointly(view)
        view = live.read()
        assert (view.fitted, view.lagging) == (8 - len(rejected), False)
        assert view.analysis.summary != alone
    assert view.analysis.json() == whole(session).json()
    assert view.analysis.with_rejected


def test_the_first_reading_of_a_session_whose_results_are_kept_has_them_all(session, monkeypatch):
    """Also what its single drops are compared with the model by."""
    cold = LiveAnalysis(session).read()
    with Session.open(session, readonly=True) as opened:
        said = results(opened, fresh=True).analysis.json()
    monkeypatch.setattr(DropCase, "read", None)
    monkeypatch.setattr("rig.analysis.session.joint_fit", None)
    view = LiveAnalysis(session).read()
    assert (view.fitted, view.lagging) == (8, False)
    assert view.analysis.json() == said
    assert view.results == cold.results
    assert not view.analysis.with_rejected
    for job in view.jobs:
        pairs = [compare(one.protocol, [one.results[job]]) for one in (view, cold)]
        assert pairs[0] == pairs[1]


def test_a_drop_is_judged_as_it_is_read(session):
    live = LiveAnalysis(session)
    view = live.read()
    with Session.open(session, readonly=True) as opened:
        for job, drop in view.drops.items():
            assert live.judge(opened, drop).json() == view.results[job].json()


def test_a_drop_that_was_read_by_a_younger_clock_is_not_read_again(session, monkeypatch):
    """And says what it says to who never saw it before, to the last bit."""
    view, cold = LiveAnalysis(session).read(), whole(session).json()
    known = {}
    for job, drop in view.drops.items():
        hz, u = view.scales[job]
        young = TimeScale(1.000003 * hz, 20.0 * u)
        known[drop] = DropCase(view.protocol, view.plan[job.run], drop, young).summary()
    monkeypatch.setattr(identify, "identify", None)
    scales = {id(drop): view.scales[job] for job, drop in view.drops.items()}
    for before in (known, KnownDrops(view.protocol)):
        drops = list(view.drops.values())
        again = analyze(view.protocol, drops, lambda drop: scales[id(drop)], summaries=before)
        assert again.json() == cold


def test_a_better_input_leaves_the_other_lines_and_their_degrees_of_freedom():
    mean = Measured(6.0, 5e-3, 100.0, {"runs": 3e-3, "common": 4e-3})
    causes = {"speed_m_s": {"datum": 4e-3}}
    line = Incline(Condition(40.0), 4, {"speed_m_s": mean}, {}, {}, causes=causes)
    (better,) = improvements([line])
    rest = 9e-6 + 16e-6 / better.times_better**2
    degrees = 100.0 * (rest / 25e-6) ** 2
    assert better.then == pytest.approx(coverage_factor(degrees) * math.sqrt(rest))


def test_reasons_of_a_blind_session_state_no_measured_value():
    values = {"alone_m_s": 6.5, "alone_U95": 0.1, "whole_m_s": 6.9, "whole_U95": 0.1}
    alone = make_reason("last_speed_differs", **values)
    angles = {"likelier_deg": 50.0, "stated_deg": 40.0}
    incline = make_reason("other_incline", alpha=0.1234, U95=0.01, **angles)
    shown = veiled_drop(replace(case(UNIFORM).analyze(), reasons=(alone, incline)))
    assert [reason.code for reason in shown.reasons] == ["last_passages_differ"]
    assert "6.5" in alone.text
    assert not any(number in str(shown.reasons) for number in ("6.5", "6.9", "0.12"))

"""Void, marginal, accepted: by limits that can be said in advance, and never a traceback."""

import json
import random
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.analysis.result import DropResult
from rig.analysis.session import analyze
from rig.analysis.verdict import _air
from rig.errors import InputError
from rig.protocol.protocol import Accept, Gates
from rig.reasons import Reason, make_reason, plain_reason
from rig.records import Edge
from sim.dials import Dials
from tests.analysis.drops import FENCE, HZ, SINGLE, UNIFORM, Case, case, codes, with_dials
from tests.examples import examples
from tests.refusals import refused

MILD = Dials(skew_sd=1e-3)
QUIET = case(UNIFORM, Dials.quiet(), incline=40.0)


def accepting(one: Case, **limits: float) -> Case:
    return replace(one, protocol=replace(one.protocol, accept=Accept(**limits)))


def only_reason(result: DropResult, verdict: str) -> Reason:
    assert result.verdict == verdict
    (reason,) = result.reasons
    return reason


# ---- limits -------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [-1, 1])
def test_skew_beyond_the_limit_is_void_within_its_uncertainty_marginal(sign):
    unit = case(UNIFORM, with_dials(skew_sd=1.0), incline=40.0).truth.release_skew_s
    one = case(UNIFORM, with_dials(skew_sd=sign * 4e-3 / unit), incline=40.0)
    measured = one.analyze().quantities["release_skew_s"]
    assert measured.value == pytest.approx(sign * 4e-3, abs=1e-7)
    expanded = measured.expanded
    for limit, verdict in ((4e-3 - 1e-6, "void"), (4e-3 + 0.99 * expanded, "marginal")):
        reason = only_reason(accepting(one, release_skew=limit).analyze(), verdict)
        assert reason.text.startswith(f"release skew {sign * 4:.2f} ms")
    result = accepting(one, release_skew=4e-3 + 1.01 * expanded).analyze()
    assert (result.verdict, result.reasons) == ("accepted", ())


@pytest.mark.parametrize(("rods", "verdict"), [(16, "accepted"), (17, "void")])
def test_missed_edges_beyond_the_limit_are_void(rods, verdict):
    """5 % of 660 edges are 33: 16 rods' pairs are within, 17 beyond."""
    rng = random.Random(2)
    passages = sorted({(edge[1], edge[3]) for edge in QUIET.truth.edges})
    lost = set(rng.sample(passages, rods))
    kept = [
        edge
        for edge, (_, channel, _, rod) in zip(QUIET.drop.edges, QUIET.truth.edges, strict=True)
        if (channel, rod) not in lost
    ]
    result = QUIET.with_edges(kept).analyze()
    assert result.verdict == verdict
    assert (result.audit.missed, result.audit.spurious) == (2 * rods, 0)
    if verdict == "void":
        text = only_reason(result, "void").text
        assert text == "34 of 660 edges missed (5.2%), limit 5.0%"


# ---- little to go by ----------------------------------------------------------------------------


@examples(10)
@given(
    st.sampled_from([QUIET, case(FENCE, Dials.quiet())]),
    st.integers(0, 8),
    st.lists(st.tuples(st.integers(-HZ, 3 * HZ), st.integers(0, 15), st.booleans()), max_size=17),
)
def test_any_few_edges_are_void(one, first, others):
    """So few cannot be the 32 of the fence less the 15 % that may be missed."""
    few = [*one.drop.edges[:first], *(Edge(*edge) for edge in others)]
    result = one.with_edges(few).analyze()
    assert result.verdict == "void"
    assert set(codes(result)) & {"few_edges_fit", "no_fall"}
    assert result.audit.received <= len(few)
    assert not result.quantities
    printable(result)


def printable(result: DropResult) -> None:
    text = json.dumps(result.json(), allow_nan=False)
    assert json.loads(text)["verdict"] == result.verdict


# ---- sessions -----------------------------------------------------------------------------------


def attempts(*numbers: tuple[int, int]) -> list:
    return [case(SINGLE, MILD, run=run, attempt=attempt).drop for run, attempt in numbers]


def scale(drop):
    return case(SINGLE, MILD).scale


def test_a_run_that_is_not_planned_or_a_scene_without_gates_is_bad_input():
    drop = replace(attempts((1, 1))[0], run=13)
    refused(InputError, "run 13 is not in the plan, which has 12", analyze, SINGLE, [drop], scale)
    damaged = [replace(drop, damage="its bytes say otherwise")]
    said = "damaged: run 13: its bytes say otherwise; see rig recov"
    refused(InputError, said, analyze, SINGLE, damaged, scale)
    refused(InputError, "no gates", analyze, replace(SINGLE, gates=Gates()), [], scale)


def test_a_session_of_void_drops_has_no_summary():
    """One was rejected with no edge at all, of the other the record itself has faults."""
    empty, faulty = attempts((1, 1), (2, 1))
    faults = (make_reason("restarted"), make_reason("crc_mismatch"))
    drops = [replace(empty, edges=()), replace(faulty, faults=faults)]
    found = analyze(SINGLE, drops, scale, {(1, 1): [plain_reason("no")]})
    assert [result.verdict for result in found.runs] == ["rejected", "void"]
    assert (found.runs[1].reasons, found.runs[1].quantities) == (faults, {})
    assert found.summary == found.with_rejected == ()
    assert "summary_with_rejected" not in found.json()
    assert analyze(SINGLE, [], scale).json() == {"runs": [], "summary": []}


@pytest.mark.parametrize(("share", "pushed"), [(0.9, False), (1.1, True)])
def test_air_that_pushes_is_told_of_beyond_its_own_uncertainty(share, pushed):
    u = 0.5 * 4.0  # of the unknown in its own units, and one of these
    fit = SimpleNamespace(
        model=SimpleNamespace(
            protocol=UNIFORM, unknowns={"drag": slice(0, 1)}, kappa=lambda _x: -share * 4.0 * u
        ),
        estimate=SimpleNamespace(x=[0.0], inverse=np.array([[0.5]]), sd=[4.0], scatter=1.0),
    )
    assert any(_air(fit)) == pushed

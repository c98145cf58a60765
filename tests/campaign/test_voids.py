"""Voids of a kind in a row: seen, said in words, and not held against their runs."""

import pytest

from rig.campaign.plan import ATTEMPTS
from rig.campaign.voids import MANY, Void, after, in_common, voids_of, why_halted
from rig.reasons import make_reason, plain_reason
from rig.records import Job
from rig.session.reading import StateEntry
from rig.session.schema import RunState
from rig.wordings import NOTE

SKEW = [make_reason("release_skew", skew_s=skew, limit_s=5e-3) for skew in (7.78e-3, -0.01, 1.0)]
LOST = make_reason("edges_lost", lost=3)
DEAD = [make_reason("gate_silent", channel=n, side="free", height_m=0.1 * n) for n in (1, 2)]
OTHER_SIDE = make_reason("gate_silent", channel=3, side="impact", height_m=0.3)
A, B = plain_reason("a"), plain_reason("b")


def row(*reasons):
    return tuple(Void(Job(n, 1), each) for n, each in enumerate(reasons, start=1))


def entries(*told):
    return [StateEntry(run, attempt, RunState(state), 0, tuple(reasons))
            for run, attempt, state, *reasons in told]  # fmt: skip


def test_reasons_are_of_a_kind_without_their_numbers():
    assert in_common(row(*((one,) for one in SKEW))) == ("release skew",)
    assert in_common(row((SKEW[0],), (LOST, SKEW[1]), (SKEW[2], LOST))) == ("release skew",)
    assert in_common(row((LOST,), (LOST,), (LOST,))) == (LOST.text,)
    assert in_common(row((DEAD[0],), (DEAD[1],), (DEAD[0],))) == ("gate silent (free)",)


@pytest.mark.parametrize(
    "reasons",
    [[], [SKEW[0]] * 2, [SKEW[0], LOST, SKEW[1]],
     [*DEAD, OTHER_SIDE]],
)  # fmt: skip
def test_fewer_or_others_have_nothing_in_common(reasons):
    found = row(*((one,) for one in reasons))
    assert in_common(found) == ()
    assert why_halted(found) == ""


def test_a_good_drop_ends_the_row_and_a_rejected_one_leaves_it():
    kept = after((), Job(1, 1), "void", (A,))
    assert after(kept, Job(1, 2), "accepted", ()) == ()
    assert after(kept, Job(1, 2), "marginal", ()) == ()
    assert after(kept, Job(1, 2), "rejected", (B,)) == kept
    assert after(kept, Job(1, 1), "rejected", (B,)) == ()
    noted = after(kept, Job(1, 1), "void", (A, plain_reason("b", NOTE)))
    assert [one.job for one in noted] == [Job(1, 1)]
    for n in range(2, 9):
        kept = after(kept, Job(1, n), "void", (A,))
    assert len(kept) == MANY


def test_voids_for_which_it_halted_are_not_held_against_their_runs():
    told = [(1, 1, "void", LOST), (2, 1, "void", SKEW[0]), (2, 2, "void", SKEW[1]),
            (3, 1, "armed"), (3, 1, "recorded")]  # fmt: skip
    before = voids_of(entries(*told))
    assert before.counts() == {1: 1, 2: 2}
    halted = [
        *told,
        (3, 1, "void", SKEW[2]),
        (3, 1, "void", SKEW[2], plain_reason("a loose plug", NOTE)),
    ]
    found = voids_of(entries(*halted))
    assert found.row == ()
    assert found.counts() == {1: 1}
    assert found.forgiven == {(2, 1), (2, 2), (3, 1)}


def test_what_was_heard_of_since_the_log_was_read_counts_once(run_line):
    found = voids_of(entries((1, 1, "void", LOST), (1, 2, "void", SKEW[0])))
    assert found.counts([run_line(1, 2)]) == {1: 2}
    assert found.counts([run_line(1, 3)]) == {1: 3} == {1: ATTEMPTS}
    assert found.counts([run_line(2, 1)]) == {1: 2, 2: 1}


@pytest.fixture
def run_line():
    from rig.campaign.plan import RunLine

    return lambda run, attempt: RunLine(run, 0.0, "A", "B", attempt, "void")

"""A plan on its way: whatever happens in whatever order, nothing falls that should not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.campaign import machine as on
from rig.campaign.machine import BEFORE_RELEASE, LOOKS, Flow, Stage, effect_failure, step
from rig.campaign.plan import ATTEMPTS, describe_setup, job_to_judge, next_job, rest_s
from rig.campaign.voids import MANY, Void, after, in_common, voids_of, why_halted
from rig.errors import RigError
from rig.link.messages import RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.protocol.protocol import Run
from rig.reasons import NOTE, make_reason, plain_reason
from rig.recorder.run_lines import RunLine
from rig.records import Job
from rig.session.reading import StateEntry
from rig.session.schema import RunState
from tests.tables import cases, read_table

JOB = Job(1, 1)
NEXT = Job(2, 1)


def ticketed(flow, event):
    """Give an answer that has no ticket the current one."""
    if isinstance(event, (on.EffectDone, on.DropVerdict, on.EffectFailure)) and event.ticket < 0:
        return event._replace(ticket=flow.ticket)
    return event


def through(flow, *events):
    """Take events in turn."""
    effects = []
    for event in events:
        flow, wanted = step(flow, ticketed(flow, event))
        effects += wanted
    return flow, effects


DONE = on.EffectDone(-1)
WARM = plain_reason("warm", NOTE)
TO_RESULT = (
    on.SessionOpen(), on.GoOn(JOB), on.GoOn(JOB, 5.0), DONE, on.EffectDone(-1, 99), on.Tick(3.1),
    DONE, DONE, on.DropVerdict(-1, "accepted", ()),
)  # fmt: skip


def test_a_run_goes_from_the_protocol_to_its_verdict():
    flow, effects = through(Flow(), *TO_RESULT)
    assert (flow.stage, flow.logged) == (Stage.RESULT, False)
    assert effects == [
        on.Wait(5.0), on.ArmRelease(JOB), on.FireRelease(99), on.Collect(JOB), on.Judge(JOB),
        on.Log(JOB, "accepted", ()),
    ]  # fmt: skip


def test_a_rejection_keeps_notes_and_can_be_taken_back():
    flow, _ = through(Flow(), *TO_RESULT, DONE)
    for event, words, logged in read_table(__file__, "notes"):
        flow, effects = through(flow, getattr(on, event)(*words))
        state, told = logged or ("", ())
        reasons = tuple(plain_reason(text, code) for code, text in told)
        assert effects == [on.Log(JOB, state, reasons)] * bool(logged), (event, words)


@cases
def test_each_event_has_its_outcome_at_each_stage(event, arguments, outcomes):
    values = [Job(*each) if isinstance(each, list) and each else each for each in arguments]
    told = {stage: words.split() for stages, words in outcomes.items() for stage in stages.split()}
    for stage in Stage:
        flow = Flow(stage=stage, job=JOB, rejection=(WARM,))
        after, effects = step(flow, getattr(on, event)(*values))
        expected = [stage.name if word == "=" else word for word in told.pop(stage.name, ())]
        seen = [after.stage.name, *(type(effect).__name__ for effect in effects)]
        assert (seen == expected) if expected else ((after, effects) == (flow, ()))
    assert not told


def test_what_a_stop_has_prevented_is_said():
    for stage, why in ((Stage.TESTING, "the release is off"), (Stage.FIRING, "nothing fell")):
        flow, _ = step(Flow(stage=stage, job=JOB), on.StopRequest())
        assert flow.trouble == f"stopped: {why}"


tickets = st.integers(-1, 12)
jobs = st.builds(Job, st.integers(1, 3), st.integers(1, 3))
happenings = st.one_of(
    st.just(on.SessionOpen()), st.just(on.SessionClose()), st.just(on.StopRequest()),
    st.builds(on.GoOn, st.none() | jobs),
    st.builds(on.EffectDone, tickets, st.none() | st.integers(0, 5)),
    st.builds(
        on.DropVerdict, tickets, st.sampled_from(["accepted", "void"]), st.just(()), st.none()
    ),
    st.builds(on.EffectFailure, tickets, st.just("no"), st.sampled_from(RefusalReason)),
    st.builds(on.Tick, st.floats(0.0, 2.0)),
    st.just(on.Lost("gone")), st.builds(on.Found, jobs), st.builds(on.Reject, st.just("x")),
    st.builds(on.Note, st.just("y")), st.builds(on.Again, jobs),
)  # fmt: skip


@given(st.lists(happenings, max_size=60), st.booleans())
def test_only_what_was_armed_and_counted_down_without_a_stop_is_fired(happening, attended):
    flow = Flow(attended=attended)
    armed, waited = None, 0.0
    for event in happening:
        before = flow
        flow, effects = step(flow, ticketed(flow, event))
        if isinstance(event, (on.StopRequest, on.Lost)):
            armed = None
        if flow.stage is Stage.COUNTDOWN and before.stage is not Stage.COUNTDOWN:
            armed, waited = event.token or 0, 0.0
        if before.stage is Stage.COUNTDOWN and isinstance(event, on.Tick):
            waited += event.seconds
        if flow.stage is Stage.COUNTDOWN:
            assert flow.left_s == pytest.approx(3.0 - waited)
        for effect in effects:
            if isinstance(effect, on.ArmRelease) and attended:
                assert isinstance(event, on.EffectDone), "nothing is armed by itself"
            if isinstance(effect, on.FireRelease):
                assert effect.token == armed
                assert waited >= flow.countdown_s - 1e-9
                armed = None
        if isinstance(event, on.StopRequest):
            assert on.Stop() in effects
            assert flow.stage not in BEFORE_RELEASE
        assert flow.ticket >= before.ticket


PASSING = (RefusalReason.COOLING, RefusalReason.GATE_BLOCKED, RefusalReason.STOPPED)


TRIED_AGAIN = {
    RefusalReason.GATE_BLOCKED, RefusalReason.GATE_UNSTEADY, RefusalReason.NOT_ARMED,
    RefusalReason.STOPPED,
}  # fmt: skip


def arming(**more):
    return through(Flow(stage=Stage.PREPARE, **more), on.GoOn(JOB, 5.0), DONE)[0]


@pytest.mark.parametrize("reason", PASSING)
def test_alone_what_passes_is_waited_for_a_few_times(reason):
    flow = arming(attended=False)
    pause = 0.7 if reason is RefusalReason.COOLING else 1.0
    for _ in range(4):
        flow, effects = through(flow, on.EffectFailure(-1, "no", reason, 700), DONE)
        assert effects == [on.Wait(pause), on.ArmRelease(JOB)]
    flow, effects = through(flow, on.EffectFailure(-1, "no", reason, 700))
    assert (flow.stage, effects) == (Stage.PREPARE, [on.GiveUp()])


@pytest.mark.parametrize("attended", [True, False])
@pytest.mark.parametrize("reason", [None, *RefusalReason])
def test_what_is_not_let_go_is_switched_off_first(reason, attended):
    flow = Flow(stage=Stage.PREPARE, attended=attended)
    for number in range(1, LOOKS + 1):
        fired = on.GoOn(JOB), DONE, on.EffectDone(-1, 7), on.Tick(9.0)
        failed = on.EffectFailure(-1, "a gate moved\nhint", reason)
        flow, effects = through(flow, *fired, failed)
        assert (flow.stage, effects[3]) == (Stage.PREPARE, on.Stop("a gate moved"))
        over = reason not in TRIED_AGAIN or (number == LOOKS and not attended)
        assert effects[4:] == ([on.GiveUp()] if over else [])


SKEW_CODE = "release_skew"


def skewed(number, code=SKEW_CODE):
    values = {"skew_s": 0.01 * number, "limit_s": 5e-3} if code == SKEW_CODE else {"edges": number}
    return make_reason(code, **values)


def void(number, reason=SKEW_CODE):
    """ArmRelease and judge one drop, which is void."""
    job = Job(1, number)
    return (
        *(on.GoOn(job), on.GoOn(job), DONE, on.EffectDone(-1, 7), on.Tick(9.0), DONE, DONE),
        *(on.DropVerdict(-1, "void", (skewed(number, reason),)), DONE),
    )


def voids(*reasons, **more):
    flow = Flow(stage=Stage.DEVICE, **more)
    for number, reason in enumerate(reasons, start=1):
        flow, _ = through(flow, *void(number, reason))
    return flow


@pytest.mark.parametrize("attended", [True, False])
def test_three_voids_of_a_kind_halt_it(attended):
    flow, effects = through(
        voids(SKEW_CODE, SKEW_CODE, SKEW_CODE, attended=attended), on.GoOn(NEXT)
    )
    assert (flow.stage, effects) == (Stage.HALTED, [])
    assert "the last 3 drops are void for the same reason: release skew" in flow.trouble
    assert "run 1 is tried again" in flow.trouble
    assert through(flow, DONE, on.Tick(9.0), on.SessionOpen()) == (flow, []), "it waits"
    flow, effects = through(flow, on.GoOn(NEXT))
    assert (flow.stage, flow.job, flow.trouble, effects) == (Stage.PREPARE, Job(1, 4), "", [])
    flow, _ = through(flow, *void(4)[1:], on.GoOn(NEXT))
    assert (flow.stage, flow.job) == (Stage.PREPARE, NEXT), "the count begins anew"


@pytest.mark.parametrize("onward", [on.GoOn(None), on.Again(Job(1, 4))])
def test_neither_the_plans_end_nor_another_attempt_passes_over_it(onward):
    flow, effects = through(voids(SKEW_CODE, SKEW_CODE, SKEW_CODE), onward)
    assert (flow.stage, effects) == (Stage.HALTED, [])


def test_a_failure_has_the_words_and_the_refusal_of_its_error():
    refusal = DeviceRefusedError(RefusalReason.COOLING, 1500)
    assert effect_failure(7, refusal)[2:] == (RefusalReason.COOLING, 1500)
    assert effect_failure(7, RigError("no", "why")) == (7, "no\nwhy", None, 0)


def test_a_drop_that_fell_has_no_refusals_left():
    flow = Flow(Stage.FIRING, job=JOB, attended=False, refusals=LOOKS - 1)
    flow, effects = through(flow, DONE)
    assert (flow.refusals, effects) == (0, [on.Collect(JOB)])


def lines(*states):
    return [RunLine(n, 0.0, "A", "B", "", 1, state) for n, state in enumerate(states, start=1)]


def test_runs_come_in_order_until_each_is_settled_or_void_too_often():
    runs = lines("accepted", "marginal", "rejected", "void", "planned")
    assert next_job(runs, {4: 1}) == Job(4, 2)
    assert next_job(runs, {4: 3}) == Job(5, 2)
    assert next_job(lines("accepted"), {}) is None
    assert next_job(lines("interrupted", "planned"), {}) == Job(1, 2)
    assert runs[0].again == Job(1, 2)
    assert job_to_judge(lines("accepted", "recorded")) == Job(2, 1)


def test_chains_rest_longer_while_the_clock_is_not_known():
    assert rest_s(0.5, None) == rest_s(0.5, 101e-6) == 2.0
    assert rest_s(0.5, 99e-6) == 0.5
    assert rest_s(9.0, None) == 9.0


def test_who_stands_at_the_rig_is_told_what_goes_where():
    """A glider on its track does not hang, and a single chain has no sides."""
    assert describe_setup(Run(1, 40.0, "A", "B")) == "incline 40° · impact side: A · free side: B"
    assert describe_setup(Run(1, 40.0, "A", None)) == "incline 40° · hang A"
    assert describe_setup(Run(1, 0.0, None, "glider")) == "put glider at its start, at rest"


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
    assert "run 3 is tried again" in why_halted(row(*((one,) for one in SKEW)))
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
    (noted,) = after(kept, Job(1, 1), "void", (A, plain_reason("b", NOTE)))
    assert noted.job == Job(1, 1)
    for n in range(2, 9):
        kept = after(kept, Job(1, n), "void", (A,))
    assert len(kept) == MANY


def test_voids_for_which_it_halted_are_not_held_against_their_runs():
    told = [(1, 1, "void", LOST), (2, 1, "void", SKEW[0]), (2, 2, "void", SKEW[1]),
            (3, 1, "armed"), (3, 1, "recorded")]  # fmt: skip
    assert voids_of(entries(*told)).counts() == {1: 1, 2: 2}
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
    return lambda run, attempt: RunLine(run, 0.0, "A", "B", "", attempt, "void")

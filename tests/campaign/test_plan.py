"""Which attempt comes next."""

from rig.campaign.plan import (
    CLOCK_S,
    CLOCK_U,
    RunLine,
    describe_setup,
    job_to_judge,
    next_job,
    rest_s,
)
from rig.protocol.protocol import Run
from rig.records import Job


def lines(*states):
    return [RunLine(n, 0.0, "A", "B", 1, state) for n, state in enumerate(states, start=1)]


def test_runs_come_in_order_until_each_is_settled_or_void_too_often():
    runs = lines("accepted", "marginal", "rejected", "void", "planned")
    assert next_job(runs, {4: 1}) == Job(4, 2)
    assert next_job(runs, {4: 3}) == Job(5, 2)
    assert next_job(lines("accepted"), {}) is None
    assert next_job(lines("interrupted", "planned"), {}) == Job(1, 2)
    assert runs[0].again == Job(1, 2)
    assert job_to_judge(lines("accepted", "recorded")) == Job(2, 1)


def test_chains_rest_longer_while_the_clock_is_not_known():
    assert rest_s(0.5, None) == rest_s(0.5, 2 * CLOCK_U) == CLOCK_S
    assert rest_s(0.5, CLOCK_U) == 0.5
    assert rest_s(9.0, None) == 9.0


def test_who_stands_at_the_rig_is_told_what_goes_where():
    """A glider on its track does not hang, and a single chain has no sides."""
    assert describe_setup(Run(1, 40.0, "A", "B")) == "incline 40° · impact side: A · free side: B"
    assert describe_setup(Run(1, 40.0, "A", None)) == "incline 40° · hang A"
    assert describe_setup(Run(1, 0.0, None, "glider")) == "put glider at its start, at rest"

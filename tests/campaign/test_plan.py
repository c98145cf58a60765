"""Which attempt comes next."""

from __future__ import annotations

from rig.campaign.plan import (
    CLOCK_S,
    CLOCK_U,
    RunLine,
    again,
    next_job,
    rest_s,
    unjudged,
)
from rig.records import Job


def lines(*states):
    return [RunLine(n, 0.0, "A", "B", 1, state) for n, state in enumerate(states, start=1)]


def test_runs_come_in_order_until_each_is_settled_or_void_too_often():
    runs = lines("accepted", "marginal", "rejected", "void", "planned")
    assert next_job(runs, {4: 1}) == Job(4, 2)
    assert next_job(runs, {4: 3}) == Job(5, 2)
    assert next_job(lines("accepted"), {}) is None
    assert next_job(lines("interrupted", "planned"), {}) == Job(1, 2)
    assert again(runs, 1) == Job(1, 2)
    assert unjudged(lines("accepted", "recorded")) == Job(2, 1)


def test_chains_rest_longer_while_the_clock_is_not_known():
    assert rest_s(0.5, None) == rest_s(0.5, 2 * CLOCK_U) == CLOCK_S
    assert rest_s(0.5, CLOCK_U) == 0.5
    assert rest_s(9.0, None) == 9.0

"""Scores of readings against the truth."""

import pytest

from bench.studies.dataset import scores


def test_scores_are_those_of_gneiting_and_raftery():
    drops = [{"session": "s", "run": run, "attempt": 1} for run in (1, 2, 3)]
    truths = [{**drop, "speed_m_s": 2.0} for drop in drops]
    stated = [(2.0, 0.1), (2.3, 0.1), (None, None)]  # held; 0.2 m/s outside; void
    readings = [
        {**drop, "entrant": "e", "quantity": "speed_m_s", "value": value, "U95": U95}
        for drop, (value, U95) in zip(drops, stated, strict=True)
    ]
    (row,) = scores(truths, readings)
    assert (row["drops"], row["coverage"]) == (3, 0.5)
    assert row["void"] == pytest.approx(1 / 3)
    assert row["interval_score"] == pytest.approx(0.2 + 0.5 * 40 * 0.2)

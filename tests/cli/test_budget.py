"""``rig analyze --budget``."""

import json
import re

import pytest


@pytest.mark.usefixtures("analysed_once")
def test_a_budget_adds_up_and_agrees_with_its_trials(call, finished):
    done = call("analyze", finished.session, "--budget", 1, "--trials", 40, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert (found["run"], found["monte_carlo"]["trials"]) == (1, 40)
    for name, one in found["budget"].items():
        assert sum(line["share"] for line in one["lines"]) == pytest.approx(1.0)
        assert one["U95"] == pytest.approx(one["k"] * one["u"])
        trial = found["monte_carlo"]["quantities"][name]
        # χ² of 39, once in 10⁴ each side.
        assert 0.6 < trial["u"] / found["by_itself"][name]["u"] < 1.45
    table = call("analyze", finished.session, "--budget", 1, "--trials", 2).out
    assert "beam heights" in table
    assert re.search(r"^Δz = [0-9.]+ ± [0-9.]+ cm", table, re.MULTILINE)
    assert "_m" not in table  # symbols, not names of JSON members
    assert max(map(len, table.splitlines())) <= 80


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((1, "--trials", "adaptve"), "found 'adaptve'; accepted: a whole number or adaptive"),
        ((99,), "run 99"),
    ],
)
def test_what_is_no_run_or_no_number_of_trials_is_bad_input(call, finished, words, said):
    done = call("analyze", finished.session, "--budget", *words)
    assert (done.code, done.out) == (2, "")
    assert said in done.err

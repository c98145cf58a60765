"""``rig analyze --budget``."""

import json
import re

import pytest


@pytest.mark.usefixtures("analysed_once")
def test_a_budget_adds_up_and_agrees_with_its_trials(call, finished):
    done = call("analyze", finished.session, "--budget", 1, "--trials", 40, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert (found["simulated"], found["run"], found["monte_carlo"]["trials"]) == (True, 1, 40)
    for name, one in found["budget"].items():
        assert sum(line["share"] for line in one["lines"]) == pytest.approx(1.0)
        assert one["U95"] == pytest.approx(one["k"] * one["u"])
        trial = found["monte_carlo"]["quantities"][name]
        # χ² of 39, once in 10⁴ each side.
        assert 0.6 < trial["u"] / found["by_itself"][name]["u"] < 1.45
    table = call("analyze", finished.session, "--budget", 1, "--trials", 2).out
    assert re.match("SIMULATED DATA\n(?s:.*)beam heights", table)
    assert re.search(r"^Δz = [0-9.]+ ± [0-9.]+ cm", table, re.MULTILINE)
    assert "by itself u" in call("analyze", finished.session, "--budget", 1).out
    assert "_m" not in table  # symbols, not names of JSON members
    assert max(map(len, table.splitlines())) <= 80


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((1, "--trials", "many"), "found 'many'; accepted: a whole number from 2"),
        ((1, "--trials", "1"), "found '1'; accepted: a whole number from 2"),
        ((99,), "there are: runs 1–4"),
    ],
)
def test_what_is_no_run_or_no_number_of_trials_is_bad_input(call, finished, words, said):
    done = call("analyze", finished.session, "--budget", *words)
    assert (done.code, done.out) == (2, "")
    assert said in done.err

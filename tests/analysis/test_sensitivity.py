"""How results move with priors: against analyses of protocols that state these priors."""

from dataclasses import replace

import pytest

from rig.analysis import sensitivity
from rig.analysis.sensitivity import FACTOR, prior_sensitivity
from tests.analysis.drops import FENCE
from tests.analysis.sessions import MILD, analysis, cases


def test_a_prior_moves_results_as_a_protocol_that_states_it_so(monkeypatch):
    # Joint fits of further priors take long.
    priors = sensitivity._priors
    name = "height_uncertainty"
    monkeypatch.setattr(sensitivity, "_priors", lambda p: {name: priors(p)[name]})
    drops = cases((1, 2, 3, 4), MILD, 3, "fence")
    found = analysis(drops)
    rows = [row for row in prior_sensitivity(FENCE, found) if row["prior"] == name]
    assert {row["quantity"] for row in rows} == {"gravity_m_s2"}
    for word, factor in (("wider", FACTOR), ("narrower", 1.0 / FACTOR)):
        other = replace(FENCE, gates=replace(FENCE.gates, height_u=0.3e-3 * factor))
        (line,) = analysis(drops, other).summary
        (here,) = found.summary
        for row in rows:
            before, after = (one.means[row["quantity"]] for one in (here, line))
            # Steps of a joint fit end when they are below 2 % of a standard uncertainty.
            assert row[word] == pytest.approx(after.value - before.value, abs=0.06 * before.u)
            ratio = after.expanded / before.expanded
            assert row[f"U95_ratio_{word}"] == pytest.approx(ratio, rel=0.03)
    # Of few drops a wider prior may even narrow U95: it is known better than their scatter is.
    assert max(abs(row["U95_ratio_wider"] - 1.0) for row in rows) > 0.05

"""Effects of chains and sides: by arithmetic on made-up runs, and against the hidden truth."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.pairs import effects
from rig.analysis.result import DropResult, Measured
from rig.link.messages import pack_label
from sim.lab import ChainLab
from tests.analysis.drops import SINGLE, UNIFORM, made_up
from tests.analysis.sessions import MILD, analysis, cases

NAMES = ("separation_m", "separation_raw_m", "speed_m_s", "release_skew_s")
TWELVE = tuple(range(1, 13))


def planned(value, u=1e-6, protocol=UNIFORM) -> list[DropResult]:
    """Every planned run accepted, with a value that may depend on its number and chain."""
    return [
        made_up(run, **{name: Measured(value(run.number, run.impact), u) for name in NAMES})
        for run in protocol.runs()
    ]


def test_a_drift_cancels_and_the_difference_stays():
    found = effects(UNIFORM, planned(lambda n, chain: 0.3 + 1e-3 * n + 2e-3 * (chain == "A")))
    assert [one.incline_deg for one in found] == sorted(UNIFORM.plan.inclines)
    for one in found:
        assert (one.chains, one.blocks) == (("A", "B"), 3)
        for measured in one.chain.values():
            assert measured.value == pytest.approx(2e-3, abs=1e-12)
        # Blocks drift apart from each other in what the sides do; their scatter says so.
        side = one.side["release_skew_s"]
        assert side.budget["runs"] == pytest.approx((2 * 4e-3**2 / 5 / 3) ** 0.5, rel=1e-9)
        assert side.expanded == pytest.approx(2.5706 * side.u, rel=1e-4)  # t of 5


def test_scatter_that_is_no_drift_counts_within_blocks_too():
    """1, −3, 3, −1 leave mean, chains and drift as they are: one degree of freedom a block."""
    off = (1e-3, -3e-3, 3e-3, -1e-3)
    for one in effects(UNIFORM, planned(lambda n, _: off[(n - 1) % 4])):
        within = (3 * 20e-6 / 5 / 3) ** 0.5
        assert one.chain["speed_m_s"].budget["runs"] == pytest.approx(within, rel=1e-9)
        assert one.side["release_skew_s"].budget["runs"] == pytest.approx(within / 2, rel=1e-9)


def test_blocks_that_lack_a_run_do_not_count():
    good = planned(lambda n, _: float(n))
    at = [n for n, one in enumerate(good) if one.run.incline_deg == 40.0]
    good[at[5]] = replace(good[at[5]], verdict="void")
    blocks = {one.incline_deg: one.blocks for one in effects(UNIFORM, good)}
    assert blocks.pop(40.0) == 2
    assert set(blocks.values()) == {3}
    assert effects(UNIFORM, good[at[5] : at[5] + 1]) == ()
    run = good[at[0]].run
    good[at[0]] = replace(good[at[0]], run=replace(run, impact=run.free, free=run.impact))
    blocks = {one.incline_deg: one.blocks for one in effects(UNIFORM, good)}
    assert blocks[40.0] == 1, "in another order it is no block"


@pytest.mark.parametrize("order", ["alternate", "fixed"])
def test_no_blocks_no_effects(order):
    other = replace(UNIFORM, plan=replace(UNIFORM.plan, order=order))
    assert effects(other, planned(lambda n, _: 0.0, protocol=other)) == ()
    assert effects(SINGLE, planned(lambda n, _: 0.0, protocol=SINGLE)) == ()


def test_runs_by_themselves_share_nothing_but_their_own_chain():
    """The scatter of each run, ½² of four of them; of what is common, that of two chains."""
    budget = {"edges": 3e-3, "spacing": 4e-3, "datum": 12e-3}
    runs_ = [
        replace(one, quantities={n: Measured(1.0, 13e-3, budget=budget)
                                 for n in NAMES})
        for one in planned(lambda n, _: 0.0)
    ]  # fmt: skip
    for one in effects(UNIFORM, runs_):
        assert one.chain["speed_m_s"].budget == pytest.approx(
            {"runs": 1e-3 * 51**0.5, "common": 2**0.5 * 4e-3}
        )
        assert one.side["release_skew_s"].budget == pytest.approx(
            {"runs": 0.5e-3 * 51**0.5, "common": 0.5**0.5 * 4e-3}
        )


def true_effects(seed: int) -> dict[str, float]:
    """What the chains alone make: the same rig and chains, and every drop like the other."""
    told = []
    calm = replace(MILD, skew_sd=0.0, hang_sd=0.0, impulse_sd=0.0)
    lab = ChainLab(UNIFORM, calm, seed, told.append)
    for run in TWELVE:
        lab.drop(pack_label(run, 1))
    weights = np.tile([0.5, -0.5, -0.5, 0.5], 3) / 3
    return {name: float(weights @ [getattr(one, name) for one in told]) for name in NAMES}


def test_effects_are_the_true_ones_within_their_uncertainty():
    """Of three intervals for 95 % one may miss it, and none by far."""
    (found,) = analysis(cases(TWELVE, MILD, 21)).effects
    true = true_effects(21)
    assert found.blocks == 3
    far = [
        abs(found.chain[name].value - true[name]) / found.chain[name].expanded
        for name in ("separation_m", "speed_m_s", "release_skew_s")
    ]
    assert sorted(far)[1] < 1.0
    assert max(far) < 1.5
    # Rods of the two chains hang up to a millimetre apart, and that is what is found.
    assert found.chain["separation_m"].u < 0.5e-3

"""Is a drop good? By limits that were fixed before any result was seen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.diagnoses import diagnose
from rig.analysis.distributions import most_by_chance
from rig.analysis.identify import MISSED

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from rig.analysis.adjust import Estimate
    from rig.analysis.fit import Fit
    from rig.analysis.identify import Identification
    from rig.analysis.result import Audit, Measured, Verdict
    from rig.protocol.protocol import Protocol
    from rig.records import Drop

SUPPORT = 0.6
"""Share of the expected edges that must be where the first guess puts them."""
LEAD = math.log(1000.0)
"""Log odds of a reading against the likeliest really different one, below which neither counts."""
RESTLESS = 2.0
"""Scatter of the edges about the adjusted motion, relative to the assumed one, that is remarked."""

LATE = 0.2
"""Share of stamps so close behind another that they may be late which a drop may have without
remark. Sixteen gates passed at 5 m/s have 5 % by chance; four times that is noise on a wire."""

_SURE = 4.0  # standard uncertainties

GLITCHES = 0.02
"""Pulses too short to be timed, relative to the edges, that a drop may have without remark."""


class Judgement(NamedTuple):
    """The verdict and why.

    Attributes
    ----------
    accused
        Those of the reasons that blame gates or chains.
    odd
        Whether it is worth to ask what else than the protocol would explain the edges.
    suspects
        Numbers of the gates to look at for that.
    """

    verdict: Verdict
    reasons: tuple[str, ...]
    accused: tuple[str, ...] = ()
    odd: bool = False
    suspects: tuple[int, ...] = ()


def judge(
    protocol: Protocol,
    drop: Drop,
    unlike: Collection[str],
    audit: Audit,
    found: Mapping[str, Measured],
    fit: Fit | None,
) -> Judgement:
    """Judge a drop; without a `fit`, only whether it can be analysed at all."""
    void = [*drop.faults]
    doubts: list[str] = []
    accused: tuple[str, ...] = ()
    suspects: tuple[int, ...] = ()
    odd = False
    if audit.lost:
        void.append(f"the device lost {audit.lost} edges: its memory was full")
    odd = bool(unlike)
    void += unlike
    if fit is not None:
        faults = diagnose(fit)
        accused, suspects = faults.void, faults.suspects
        void += _limits(protocol, audit, found)
        void += accused
        estimate, missed = (
            fit.estimate,
            audit.missed > _most_missed(audit.matched + audit.missed, protocol.accept.missed_edges),
        )
        odd = bool(accused) or missed or estimate.scatter > RESTLESS or not estimate.settled
        if void:
            void += faults.doubts  # which may be why
        doubts += faults.doubts
        doubts += _doubts(protocol, drop, audit, found, fit.estimate)
        doubts += _pushed(fit)
    if void:
        return Judgement("void", tuple(void), accused, odd, suspects)
    return Judgement("marginal" if doubts else "accepted", tuple(doubts), accused, odd, suspects)


def pattern_faults(identified: Identification) -> dict[str, str]:
    """Say why the edges are not one fall of each chain, by role; nothing where they are."""
    found = {
        role: f"the {role} side does not look like this chain falling: only {share:.0%} of the "
        "expected edges are where one fall would put them"
        for role, share in identified.shares.items()
        if share < SUPPORT
    }
    if not found and identified.fit is None:
        return dict.fromkeys(
            identified.shares,
            "this does not look like this chain falling: no motion fits edges enough of both sides"
            if len(identified.shares) > 1
            else "this does not look like this chain falling: no motion fits its edges",
        )
    if not found and identified.log_odds < LEAD:
        odds = math.exp(identified.log_odds)
        return dict.fromkeys(
            identified.shares,
            f"these edges fit two falls: the odds of the likelier one are only {odds:.3g} to 1",
        )
    return found


def _limits(protocol: Protocol, audit: Audit, found: Mapping[str, Measured]) -> list[str]:
    """Return what is beyond the protocol's ``accept``."""
    accept = protocol.accept
    void = []
    expected = audit.matched + audit.missed
    if audit.missed > _most_missed(expected, accept.missed_edges):
        void.append(_many_missed(audit, accept.missed_edges))
    skew = found.get("release_skew_s")
    if skew is not None and _too_late(skew, accept.release_skew):
        void.append(
            f"release skew {skew.value * 1e3:.2f} ms is beyond {accept.release_skew * 1e3:g} ms"
        )
    return void


def _too_late(skew: Measured, limit: float) -> bool:
    """Whether releases were further apart than is accepted.

    What is less sure than the limit is large must be beyond it with its uncertainty.
    """
    return abs(skew.value) - (skew.expanded if skew.expanded > limit else 0.0) > limit


def _most_missed(expected: int, limit: float) -> float:
    """Return how many edges may be missed before a drop is void.

    Of few edges one is a large share: a rig that misses as many as usual must not lose more than a
    drop in a thousand by chance.
    """
    return max(limit * expected, most_by_chance(expected, min(MISSED, limit / 2.0)))


def _many_missed(audit: Audit, limit: float) -> str:
    expected = audit.matched + audit.missed
    share = audit.missed / expected
    return f"{audit.missed} of {expected} edges missed ({share:.1%}), more than {limit:.1%}"


def _doubts(
    protocol: Protocol,
    drop: Drop,
    audit: Audit,
    found: Mapping[str, Measured],
    estimate: Estimate,
) -> list[str]:
    """Return what makes a drop marginal."""
    doubts = []
    expected, missed = audit.matched + audit.missed, protocol.accept.missed_edges
    if missed * expected < audit.missed <= _most_missed(expected, missed):
        doubts.append(f"{_many_missed(audit, missed)}, which of so few edges may be chance")
    skew = found.get("release_skew_s")
    limit = protocol.accept.release_skew
    near = skew is not None and abs(abs(skew.value) - limit) < skew.expanded
    if skew is not None and near and not _too_late(skew, limit):
        doubts.append(
            f"release skew {skew.value * 1e3:.2f} ms is within its uncertainty of the limit"
        )
    if estimate.scatter > RESTLESS:
        doubts.append(
            f"edges scatter {estimate.scatter:.1f} times as much as assumed; "
            "the uncertainties are enlarged to match"
        )
    if not estimate.settled:
        doubts.append("the adjustment did not settle: no motion fits these edges well")
    device, edges = drop.certificate, max(1, len(drop.edges))
    if device is not None and device.late > LATE * edges:
        doubts.append(f"{device.late} time stamps may be late")
    if device is not None and device.glitches > GLITCHES * edges:
        doubts.append(f"{device.glitches} pulses were too short to be timed")
    return doubts


def _pushed(fit: Fit) -> list[str]:
    """Air only holds back: where it seems to push, something is not as it is said to be."""
    model, estimate = fit.model, fit.estimate
    if "drag" not in model.unknowns:
        return []
    at = model.unknowns["drag"].start
    kappa = float(estimate.x[at])
    u = math.sqrt(estimate.covariance[at, at]) * float(estimate.sd[at])
    if kappa > -_SURE * u:
        return []
    return [
        f"these are edges of a fall that the air speeds up (κ = {kappa:.2g} ± {2 * u:.1g} per m): "
        "the clock, the gates' heights or gravity are not as stated"
    ]

"""Is a drop good? By limits that were fixed before any result was seen."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.deciding import deciding_gate
from rig.analysis.diagnoses import IMPLAUSIBLE, diagnose
from rig.analysis.distributions import most_by_chance
from rig.analysis.faults import other_air
from rig.analysis.identify import MISSED
from rig.analysis.inclines import other_incline
from rig.analysis.last_passages import disagreements

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from rig.analysis.adjust import Estimate
    from rig.analysis.edge_classes import UnmatchedEdge
    from rig.analysis.fit import Fit
    from rig.analysis.identify import Identification
    from rig.analysis.result import Audit, Measured, Verdict
    from rig.protocol.protocol import Protocol, Run
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

_PULSE = 2  # edges
_SURE = 4.0  # standard uncertainties
_BEYOND = 3.0  # prior standard uncertainties of κ

GLITCHES = 0.02
"""Pulses too short to be timed, relative to the edges, that a drop may have without remark."""


class Judgement(NamedTuple):
    """The verdict and why.

    Attributes
    ----------
    accused
        Those of the reasons that blame gates, chains or clock.
    odd
        Whether it is worth to ask what else than the protocol would explain the edges.
    suspects
        Numbers of the gates to look at for that.
    known
        Whether the reason explains all else that is odd, so that no other is to be sought.
    """

    verdict: Verdict
    reasons: tuple[str, ...]
    accused: tuple[str, ...] = ()
    odd: bool = False
    suspects: tuple[int, ...] = ()
    known: bool = False


def judge(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    unlike: Collection[str],
    audit: Audit,
    found: Mapping[str, Measured],
    fit: Fit | None,
    alone: Mapping[str, Measured] = MappingProxyType({}),
    unmatched: Collection[UnmatchedEdge] = (),
) -> Judgement:
    """Judge a drop; without a `fit`, only whether it can be analysed at all.

    Parameters
    ----------
    alone
        What its last passages say by themselves.
    unmatched
        Edges that are missing or belong to no rod.
    """
    void = [*drop.faults]
    doubts: list[str] = []
    accused: tuple[str, ...] = ()
    suspects: tuple[int, ...] = ()
    odd = False
    remarks: tuple[str, ...] = ()
    if audit.lost:
        void.append(f"the device lost {audit.lost} edges: its memory was full")
    odd = bool(unlike)
    void += unlike
    if fit is not None:
        faults = diagnose(fit)
        if faults.known:  # all else that is odd follows from it
            return Judgement("void", (*void, *faults.void), known=True)
        # A motion in the wrong air tells nothing of the gates.
        accused, suspects = _other_air(fit) or faults.void, faults.suspects
        void += _limits(protocol, audit, found)
        void += accused
        void += _blown(fit)
        estimate, missed = (
            fit.estimate,
            audit.missed > _most_missed(audit.expected, protocol.accept.missed_edges),
        )
        if void:
            void += faults.doubts  # which may be why
        doubts += faults.doubts
        doubts += _doubts(protocol, drop, audit, found, fit.estimate)
        pushed = _pushed(fit)
        remarks = other_incline(fit, run)
        accused += (*pushed, *remarks)
        doubts += pushed
        restless = estimate.scatter > RESTLESS or not estimate.settled
        odd = faults.odd or bool(pushed) or missed or restless
        doubts += disagreements(found, alone)
    if void:
        return Judgement("void", tuple(void), accused, odd, suspects)
    # A drop is as good where the model's α is not its own: that is what is measured.
    verdict: Verdict = "marginal" if doubts else "accepted"
    remarks += _later_passages(unmatched)
    return Judgement(verdict, (*doubts, *remarks), accused, odd, suspects)


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
        return dict.fromkeys(identified.shares, _ambiguous(identified))
    return found


def _ambiguous(identified: Identification) -> str:
    """Say that two falls fit, and with which further gate only one of them would."""
    odds = math.exp(identified.log_odds)
    text = f"these edges fit two falls: the odds of the likelier one are only {odds:.3g} to 1"
    if identified.fit is None or identified.other is None:
        return text
    side, height = deciding_gate(identified.fit, identified.other)
    return f"{text}; a further {side} gate at {height * 1e3:.0f} mm would tell which"


def _limits(protocol: Protocol, audit: Audit, found: Mapping[str, Measured]) -> list[str]:
    """Return what is beyond the protocol's ``accept``."""
    accept = protocol.accept
    void = []
    if audit.missed > _most_missed(audit.expected, accept.missed_edges):
        void.append(_many_missed(audit, accept.missed_edges))
    if audit.unexplained > _most_unexplained(audit.received, accept.unexplained_edges):
        void.append(_many_unexplained(audit, accept.unexplained_edges))
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
    share = audit.missed / audit.expected
    return f"{audit.missed} of {audit.expected} edges missed ({share:.1%}), more than {limit:.1%}"


def _most_unexplained(received: int, limit: float) -> float:
    """Return how many edges may be unexplained before a drop is void: always one stray pulse."""
    return max(limit * received, _PULSE)


def _many_unexplained(audit: Audit, limit: float) -> str:
    share = audit.unexplained / audit.received
    return (
        f"{audit.unexplained} of {audit.received} edges unexplained ({share:.1%}), more than "
        f"{limit:.1%}"
    )


def _later_passages(unmatched: Collection[UnmatchedEdge]) -> tuple[str, ...]:
    """Say how many edges of later passages a result is without."""
    later = sum(edge.kind == "later passage" for edge in unmatched)
    return (f"{later} edges after the passage were left out: it came back",) if later else ()


def _doubts(
    protocol: Protocol,
    drop: Drop,
    audit: Audit,
    found: Mapping[str, Measured],
    estimate: Estimate,
) -> list[str]:
    """Return what makes a drop marginal."""
    doubts = []
    missed, unexplained = protocol.accept.missed_edges, protocol.accept.unexplained_edges
    if missed * audit.expected < audit.missed <= _most_missed(audit.expected, missed):
        doubts.append(f"{_many_missed(audit, missed)}, which of so few edges may be chance")
    if unexplained * audit.received < audit.unexplained <= _PULSE:
        doubts.append(f"{_many_unexplained(audit, unexplained)}, which may be one stray pulse")
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


def _blown(fit: Fit) -> list[str]:
    """Air that nobody would expect explains much; where edges do not fit even so, it is no fall."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    if estimate.scatter <= RESTLESS or abs(estimate.x[at]) <= _BEYOND * estimate.sd[at]:
        return []
    return [
        "this does not look like this chain falling: even with what air would have to take "
        f"(κ = {model.kappa(estimate.x):.2g} per m) edges scatter {estimate.scatter:.1f} times as "
        "much as assumed"
    ]


def _other_air(fit: Fit) -> tuple[str, ...]:
    """Edges tell the air better than a protocol does: where it is not as stated, that is said."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    off, sd = float(estimate.x[at]), float(estimate.sd[at])
    if model.protocol.drag is None or abs(off) <= IMPLAUSIBLE * sd:
        return ()
    # By the edges alone, without what the protocol makes of them.
    share = 1.0 / (1.0 - min(float(estimate.covariance[at, at]), 0.9))
    kappa = model.kappa(estimate.x) + (share - 1.0) * off
    return (other_air(kappa, math.sqrt(share * estimate.covariance[at, at]) * sd),)


def _pushed(fit: Fit) -> tuple[str, ...]:
    """Air only holds back: where it seems to push, something is not as it is said to be."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    kappa = model.kappa(estimate.x)
    u = math.sqrt(estimate.covariance[at, at]) * float(estimate.sd[at])
    if kappa >= -_SURE * u:
        return ()
    return (
        f"these are edges of a fall that the air speeds up (κ = {kappa:.2g} ± {2 * u:.1g} per m): "
        "the clock, the gates' heights or gravity are not as stated",
    )

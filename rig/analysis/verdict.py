"""Is a drop good? By limits that were fixed before any result was seen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.annealing import MISSED
from rig.analysis.diagnoses import IMPLAUSIBLE, diagnose
from rig.analysis.distributions import most_by_chance
from rig.analysis.identify import deciding_gate
from rig.analysis.inclines import other_incline
from rig.analysis.last_passages import disagreements
from rig.reasons import Reason, make_reason
from rig.vocabulary import ANY_SCENE
from rig.wordings import Severity

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from rig.analysis.adjust import Estimate
    from rig.analysis.edge_classes import UnmatchedEdge
    from rig.analysis.fit import Fit
    from rig.analysis.identify import Identification
    from rig.analysis.result import Audit, DropResult, Measured, Verdict
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Drop
    from rig.vocabulary import Vocabulary

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

    reasons: tuple[Reason, ...]
    accused: tuple[Reason, ...] = ()
    odd: bool = False
    suspects: tuple[int, ...] = ()
    known: bool = False

    @property
    def verdict(self) -> Verdict:
        """What the gravest reason makes of the drop."""
        return verdict_of(self.reasons)


def verdict_of(reasons: Iterable[Reason]) -> Verdict:
    """Return the verdict that the gravest of some reasons makes of a drop."""
    gravest = max((reason.severity for reason in reasons), default=Severity.REMARK)
    verdicts: dict[Severity, Verdict] = {
        Severity.VOID: "void",
        Severity.DOUBT: "marginal",
        Severity.REMARK: "accepted",
    }
    return verdicts[gravest]


def judge_record(drop: Drop, audit: Audit, unlike: Iterable[Reason] = ()) -> Judgement:
    """Judge whether a drop can be analysed at all.

    Parameters
    ----------
    unlike
        Why its edges are not one fall of each chain.
    """
    faults = {reason.code: reason for reason in drop.faults}
    if audit.lost:
        faults.setdefault("edges_lost", make_reason("edges_lost", lost=audit.lost))
    unlike = tuple(unlike)
    return Judgement((*faults.values(), *unlike), odd=bool(unlike))


def judge(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    audit: Audit,
    values: Mapping[str, Measured],
    fit: Fit,
    by_passages: Mapping[str, Measured],
    unmatched: Collection[UnmatchedEdge],
) -> Judgement:
    """Judge a drop by what was fitted.

    Parameters
    ----------
    by_passages
        What its last passages say by themselves.
    unmatched
        Edges that are missing or belong to no rod.
    """
    record = judge_record(drop, audit).reasons
    faults = diagnose(fit)
    void = [reason for reason in faults.reasons if reason.severity is Severity.VOID]
    if faults.known:  # all else that is odd follows from it
        return Judgement((*record, *void), known=True)
    # A motion in the wrong air tells nothing of the gates.
    accused = _other_air(fit) or tuple(void)
    void = [*record, *_limits(protocol, audit, values), *accused, *_blown(fit)]
    doubts = [reason for reason in faults.reasons if reason.severity is not Severity.VOID]
    pushed = _pushed(fit)
    remarks = other_incline(fit, run)
    estimate = fit.estimate
    missed = audit.missed > _most_missed(audit.expected, protocol.accept.missed_edges)
    restless = estimate.scatter > RESTLESS or not estimate.settled
    odd = faults.odd or bool(pushed) or missed or restless
    accused += (*pushed, *remarks)
    if void:  # what is doubtful about gates may be why
        return Judgement((*void, *doubts), accused, odd, faults.suspects)
    doubts += [*_doubts(protocol, drop, audit, values, estimate), *pushed]
    doubts += disagreements(values, by_passages)
    # A drop is as good where the model's α is not its own: that is what is measured.
    remarks += _later_passages(protocol, unmatched)
    return Judgement((*doubts, *remarks), accused, odd, faults.suspects)


def pattern_faults(identified: Identification, words: Vocabulary = ANY_SCENE) -> dict[str, Reason]:
    """Say why the edges are not one fall of each chain, by role; nothing where they are."""
    reasons = {
        role: make_reason("few_edges_fit", words, side=role, share=share)
        for role, share in identified.shares.items()
        if share < SUPPORT
    }
    if not reasons and identified.fit is None:
        return dict.fromkeys(identified.shares, make_reason("no_fall", words))
    if not reasons and identified.log_odds < LEAD:
        return dict.fromkeys(identified.shares, _ambiguous(words, identified))
    return reasons


def _ambiguous(words: Vocabulary, identified: Identification) -> Reason:
    """Say that two falls fit, and with which further gate only one of them would."""
    odds = math.exp(identified.log_odds)
    if identified.fit is None or identified.other is None:
        return make_reason("two_falls", words, odds=odds)
    side, height = deciding_gate(identified.fit, identified.other)
    return make_reason("two_falls_gate", words, odds=odds, side=side, height_m=height)


def _limits(protocol: Protocol, audit: Audit, values: Mapping[str, Measured]) -> Iterator[Reason]:
    """Yield what is beyond the protocol's ``accept``."""
    accept, words = protocol.accept, protocol.vocabulary
    if audit.missed > _most_missed(audit.expected, accept.missed_edges):
        yield _many_missed("edges_missed", words, audit, accept.missed_edges)
    if audit.unexplained > _most_unexplained(audit.received, accept.unexplained_edges):
        yield _many_unexplained("edges_unexplained", words, audit, accept.unexplained_edges)
    yield from (why for why in release_reasons(protocol, values) if why.severity is Severity.VOID)


def release_reasons(protocol: Protocol, values: Mapping[str, Measured]) -> tuple[Reason, ...]:
    """Say that releases were too far apart, or that nobody can tell; nothing where all is well."""
    skew, limit = values.get("release_skew_s"), protocol.accept.release_skew
    if skew is None:
        return ()
    near = abs(abs(skew.value) - limit) < skew.expanded
    code = "release_skew" if _too_late(skew, limit) else "release_skew_near" if near else ""
    return (make_reason(code, skew_s=skew.value, limit_s=limit),) if code else ()


def nearly_in_time(result: DropResult, limit: float) -> bool:
    """Whether a drop is void for its release alone, and by no more than that is uncertain."""
    if result.verdict != "void":
        return False
    if {why.code for why in result.reasons if why.severity is Severity.VOID} != {"release_skew"}:
        return False
    skew = result.quantities["release_skew_s"]
    return abs(skew.value) - skew.expanded < limit


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


def _many_missed(code: str, words: Vocabulary, audit: Audit, limit: float) -> Reason:
    return make_reason(code, words, missed=audit.missed, expected=audit.expected, limit=limit)


def _most_unexplained(received: int, limit: float) -> float:
    """Return how many edges may be unexplained before a drop is void: always one stray pulse."""
    return max(limit * received, _PULSE)


def _many_unexplained(code: str, words: Vocabulary, audit: Audit, limit: float) -> Reason:
    counts = {"unexplained": audit.unexplained, "received": audit.received}
    return make_reason(code, words, **counts, limit=limit)


def _later_passages(protocol: Protocol, unmatched: Collection[UnmatchedEdge]) -> tuple[Reason, ...]:
    """Say how many edges of later passages a result is without."""
    edges = sum(edge.kind == "later passage" for edge in unmatched)
    return (make_reason("later_passages", protocol.vocabulary, edges=edges),) if edges else ()


def _doubts(
    protocol: Protocol,
    drop: Drop,
    audit: Audit,
    values: Mapping[str, Measured],
    estimate: Estimate,
) -> Iterator[Reason]:
    """Yield what makes a drop marginal."""
    missed, unexplained = protocol.accept.missed_edges, protocol.accept.unexplained_edges
    words = protocol.vocabulary
    if missed * audit.expected < audit.missed <= _most_missed(audit.expected, missed):
        yield _many_missed("edges_missed_few", words, audit, missed)
    if unexplained * audit.received < audit.unexplained <= _PULSE:
        yield _many_unexplained("edges_unexplained_few", words, audit, unexplained)
    yield from (why for why in release_reasons(protocol, values) if why.severity is Severity.DOUBT)
    if estimate.scatter > RESTLESS:
        yield make_reason("scatter", factor=estimate.scatter)
    if not estimate.settled:
        yield make_reason("not_converged", words)
    device, edges = drop.certificate, max(1, len(drop.edges))
    if device is not None and device.late > LATE * edges:
        yield make_reason("late_stamps", edges=device.late)
    if device is not None and device.glitches > GLITCHES * edges:
        yield make_reason("short_pulses", pulses=device.glitches)


def _blown(fit: Fit) -> Iterator[Reason]:
    """Air that nobody would expect explains much; where edges do not fit even so, it is no fall."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    if estimate.scatter > RESTLESS and abs(estimate.x[at]) > _BEYOND * estimate.sd[at]:
        yield make_reason(
            "air_implausible",
            model.protocol.vocabulary,
            kappa=float(model.kappa(estimate.x)),
            factor=estimate.scatter,
        )


def _other_air(fit: Fit) -> tuple[Reason, ...]:
    """Edges tell the air better than a protocol does: where it is not as stated, that is said."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    off, sd = float(estimate.x[at]), float(estimate.sd[at])
    if model.protocol.drag is None or abs(off) <= IMPLAUSIBLE * sd:
        return ()
    # By the edges alone, without what the protocol makes of them.
    share = 1.0 / (1.0 - min(float(estimate.covariance[at, at]), 0.9))
    kappa = model.kappa(estimate.x) + (share - 1.0) * off
    u = math.sqrt(share * estimate.covariance[at, at]) * sd
    return (make_reason("air", model.protocol.vocabulary, kappa=float(kappa), U95=2.0 * u),)


def _pushed(fit: Fit) -> tuple[Reason, ...]:
    """Air only holds back: where it seems to push, something is not as it is said to be."""
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    kappa = float(model.kappa(estimate.x))
    u = math.sqrt(estimate.covariance[at, at]) * float(estimate.sd[at])
    if kappa >= -_SURE * u:
        return ()
    words = model.protocol.vocabulary
    return (make_reason("air_accelerates", words, kappa=kappa, U95=2.0 * u),)

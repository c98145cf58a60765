"""Is a drop good? By limits that were fixed before any result was seen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.analysis.annealing import MISSED
from rig.analysis.chain_records import SIDES
from rig.analysis.diagnoses import Diagnosis, diagnose
from rig.analysis.distributions import most_by_chance
from rig.analysis.equations import STRAY
from rig.analysis.identify import RESTLESS
from rig.analysis.inclines import other_incline
from rig.analysis.last_passages import APART, disagreements
from rig.reasons import Reason, make_reason
from rig.wordings import Severity

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from rig.analysis.adjust import Estimate
    from rig.analysis.edge_classes import UnmatchedEdge
    from rig.analysis.fit import Fit
    from rig.analysis.result import Audit, DropResult, Measured, Verdict
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Drop

LATE = 0.2
"""Share of stamps so close behind another that they may be late which a drop may have without
remark. Sixteen gates passed at 5 m/s have 5 % by chance; four times that is noise on a wire."""

_SURE = 4.0  # standard uncertainties


def verdict_of(reasons: Iterable[Reason]) -> Verdict:
    """Return the verdict that the gravest of some reasons makes of a drop."""
    gravest = max((reason.severity for reason in reasons), default=Severity.REMARK)
    verdicts: dict[Severity, Verdict] = {
        Severity.VOID: "void",
        Severity.DOUBT: "marginal",
        Severity.REMARK: "accepted",
    }
    return verdicts[gravest]


def judge_record(drop: Drop, audit: Audit) -> tuple[Reason, ...]:
    """Say why a drop cannot be analysed at all; nothing where it can."""
    faults = {reason.code: reason for reason in drop.faults}
    if audit.lost:
        faults.setdefault("edges_lost", make_reason("edges_lost", lost=audit.lost))
    return tuple(faults.values())


def judge(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    audit: Audit,
    values: Mapping[str, Measured],
    fit: Fit,
    by_passages: Mapping[str, Measured],
    unmatched: Collection[UnmatchedEdge],
) -> Diagnosis:
    """Judge a drop by what was fitted.

    Parameters
    ----------
    by_passages
        What its last passages say by themselves.
    unmatched
        Edges that are missing or belong to no rod.
    """
    record, diagnosis = judge_record(drop, audit), diagnose(fit)
    void, doubts = _by_severity(diagnosis.reasons)
    if diagnosis.known:  # all else that is odd follows from it
        return Diagnosis((*record, *void), known=True)
    air, remarks, estimate = _air(fit), other_incline(fit, run), fit.estimate
    # A motion in the wrong air tells nothing of the gates.
    accused = air["air"] or tuple(void)
    beyond, near = _by_severity([*_counts(protocol, audit), *release_reasons(protocol, values)])
    missed = any(reason.code == "edges_missed" for reason in beyond)
    restless = estimate.scatter > RESTLESS or not estimate.settled
    pushed = air["air_accelerates"]
    odd = diagnosis.odd or bool(pushed) or missed or restless
    void = [*record, *beyond, *accused, *air["air_implausible"]]
    reasons = [*void, *doubts]  # what is doubtful about gates may be why
    if not void:
        reasons += [*near, *_doubts(protocol, drop, estimate), *pushed]
        reasons += disagreements(values, by_passages)
        # A drop is as good where the model's α is not its own: that is what is measured.
        reasons += [*remarks, *_later_passages(protocol, unmatched)]
    return Diagnosis(tuple(reasons), diagnosis.suspects, odd, accused=(*accused, *pushed, *remarks))


def _by_severity(reasons: Iterable[Reason]) -> tuple[list[Reason], list[Reason]]:
    """Part reasons for which a drop is void from all others."""
    parts: tuple[list[Reason], list[Reason]] = [], []
    for reason in reasons:
        parts[reason.severity is not Severity.VOID].append(reason)
    return parts


def _counts(protocol: Protocol, audit: Audit) -> Iterator[Reason]:
    """Yield which edges are more than the protocol accepts, or more but for so few of them.

    Of few edges one is a large share: a rig that misses as many as usual must not lose more than a
    drop in a thousand by chance; and one stray pulse may always come.
    """
    accept = protocol.accept
    chance = most_by_chance(audit.expected, min(MISSED, accept.missed_edges / 2.0))
    missed = {"missed": audit.missed, "expected": audit.expected}
    stray = {"unexplained": audit.unexplained, "received": audit.received}
    for code, few, limit, tolerable, counts in (
        ("edges_missed", "edges_missed_few", accept.missed_edges, chance, missed),
        ("edges_unexplained", "edges_unexplained_few", accept.unexplained_edges, SIDES, stray),
    ):
        count, total = counts.values()
        if count > limit * total:
            why = code if count > tolerable else few
            yield make_reason(why, protocol.vocabulary, **counts, limit=limit)


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


def _later_passages(protocol: Protocol, unmatched: Collection[UnmatchedEdge]) -> tuple[Reason, ...]:
    """Say how many edges of later passages a result is without."""
    edges = sum(edge.kind == "later passage" for edge in unmatched)
    return (make_reason("later_passages", protocol.vocabulary, edges=edges),) if edges else ()


def _doubts(protocol: Protocol, drop: Drop, estimate: Estimate) -> Iterator[Reason]:
    """Yield what is remarkable about a fit and a device."""
    if estimate.scatter > RESTLESS:
        yield make_reason("scatter", factor=estimate.scatter)
    if not estimate.settled:
        yield make_reason("not_converged", protocol.vocabulary)
    device, edges = drop.certificate, max(1, len(drop.edges))
    if device is not None and device.late > LATE * edges:
        yield make_reason("late_stamps", edges=device.late)
    # A pulse too short to be timed may be an edge that left no trace.
    if device is not None and device.glitches > MISSED * edges:
        yield make_reason("short_pulses", pulses=device.glitches)


def _air(fit: Fit) -> dict[str, tuple[Reason, ...]]:
    """Say what an adjusted motion tells of the air, by code; nothing where all is well.

    Edges tell the air better than a protocol does: where it is not as stated, that is said. Where
    air that nobody would expect explains much and edges do not fit even so, it is no fall. And air
    only holds back: where it seems to push, something is not as it is said to be.
    """
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    off, sd = float(estimate.x[at]), float(estimate.sd[at])
    kappa = float(model.kappa(estimate.x))
    variance = float(estimate.inverse[at] @ estimate.inverse[at])
    u = math.sqrt(variance) * sd
    # By the edges alone, without what the protocol makes of them.
    share = 1.0 / (1.0 - min(variance, 0.9))
    alone = {"kappa": kappa + (share - 1.0) * off, "U95": 2.0 * math.sqrt(share) * u}
    blown = estimate.scatter > RESTLESS and abs(off) > APART * sd
    table: dict[str, tuple[bool, dict[str, float]]] = {
        "air": (model.protocol.drag is not None and abs(off) > STRAY * sd, alone),
        "air_implausible": (blown, {"kappa": kappa, "factor": estimate.scatter}),
        "air_accelerates": (kappa < -_SURE * u, {"kappa": kappa, "U95": 2.0 * u}),
    }
    words = model.protocol.vocabulary
    return {
        code: (make_reason(code, words, **values),) if holds else ()
        for code, (holds, values) in table.items()
    }

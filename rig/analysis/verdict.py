"""Verdict on a drop, by limits that are fixed before any result is seen."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping

from rig.analysis.adjust import Estimate
from rig.analysis.annealing import MISSED
from rig.analysis.chain_records import SIDES
from rig.analysis.diagnoses import Diagnosis, diagnose
from rig.analysis.distributions import most_by_chance
from rig.analysis.edge_classes import UnmatchedEdge
from rig.analysis.equations import STRAY
from rig.analysis.fit import Fit
from rig.analysis.identify import RESTLESS
from rig.analysis.inclines import other_incline
from rig.analysis.last_passages import APART, disagreements
from rig.analysis.result import Audit, DropResult, Measured, Verdict
from rig.measurands import RELEASE_SKEW
from rig.protocol.protocol import Protocol, Run
from rig.reasons import Reason, make_reason
from rig.records import Drop
from rig.wordings import Severity

LATE = 0.2
"""Share of possibly late stamps, close after another stamp, above which a remark is made. Sixteen
gates passed at 5 m/s have 5 % by chance; four times that is noise on a wire."""

_SURE = 4.0  # standard uncertainties


def verdict_of(reasons: Iterable[Reason]) -> Verdict:
    """Return the verdict by the most severe reason."""
    severities = {reason.severity for reason in reasons}
    if Severity.VOID in severities:
        return "void"
    return "marginal" if Severity.DOUBT in severities else "accepted"


def judge_record(drop: Drop, audit: Audit) -> tuple[Reason, ...]:
    """Return reasons why a record cannot be analysed; empty if it can."""
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
    """Return all reasons about a fitted drop, and the gates under suspicion.

    Parameters
    ----------
    by_passages
        Measurands from the last passages alone.
    unmatched
        Edges that are missing or belong to no rod.
    """
    record, diagnosis = judge_record(drop, audit), diagnose(fit)
    void, doubts = _by_severity(diagnosis.reasons)
    if diagnosis.known:  # the known fault causes all other oddities
        return Diagnosis((*record, *void), known=True)
    air, remarks, estimate = _air(fit), other_incline(fit, run), fit.estimate
    # With wrong drag, the fit says nothing about the gates.
    accused = air["air"] or tuple(void)
    beyond, near = _by_severity([*_counts(protocol, audit), *release_reasons(protocol, values)])
    pushed = air["air_accelerates"]
    odd = diagnosis.odd or bool(pushed) or any(why.code == "edges_missed" for why in beyond)
    odd |= estimate.scatter > RESTLESS or not estimate.settled
    void = [*record, *beyond, *accused, *air["air_implausible"]]
    reasons = [*void, *doubts]  # doubts about gates may be the cause
    if not void:
        reasons += [*near, *_doubts(protocol, drop, estimate), *pushed]
        # A drop whose α differs from the model's is still good: that is a result.
        reasons += [*disagreements(values, by_passages), *remarks]
        later = sum(edge.kind == "later passage" for edge in unmatched)
        reasons += [make_reason("later_passages", protocol.vocabulary, edges=later)] * (later > 0)
    return Diagnosis(tuple(reasons), diagnosis.suspects, odd, accused=(*accused, *pushed, *remarks))


def _by_severity(reasons: Iterable[Reason]) -> tuple[list[Reason], list[Reason]]:
    """Split reasons into those that make a drop void and all others."""
    parts: tuple[list[Reason], list[Reason]] = [], []
    for reason in reasons:
        parts[reason.severity is not Severity.VOID].append(reason)
    return parts


def _counts(protocol: Protocol, audit: Audit) -> Iterator[Reason]:
    """Yield reasons for missed or unexplained edges above the protocol's limits.

    With few edges, a single edge is a large share. So a rig with the usual rate of misses must not
    lose more than 1 drop in 1000 by chance, and a single stray pulse is tolerated.
    """
    accept = protocol.accept
    chance = most_by_chance(audit.edge_count, min(MISSED, accept.missed_edges / 2.0))
    if audit.missed > accept.missed_edges * audit.edge_count:
        why = "edges_missed" if audit.missed > chance else "edges_missed_few"
        counts = {"missed": audit.missed, "expected": audit.edge_count}
        yield make_reason(why, protocol.vocabulary, **counts, limit=accept.missed_edges)
    if audit.unexplained > accept.unexplained_edges * audit.received:
        why = "edges_unexplained" if audit.unexplained > SIDES else "edges_unexplained_few"
        counts = {"unexplained": audit.unexplained, "received": audit.received}
        yield make_reason(why, protocol.vocabulary, **counts, limit=accept.unexplained_edges)


def release_reasons(protocol: Protocol, values: Mapping[str, Measured]) -> tuple[Reason, ...]:
    """Return the reason for a release skew above its limit, or too uncertain; empty if neither.

    If its expanded uncertainty exceeds the limit, the skew must exceed both together.
    """
    skew, limit = values.get(RELEASE_SKEW.name), protocol.accept.release_skew
    if skew is None:
        return ()
    size, u95 = abs(skew.value), skew.expanded
    beyond = size - (u95 if u95 > limit else 0.0) > limit
    if not beyond and abs(size - limit) >= u95:
        return ()
    code = "release_skew" if beyond else "release_skew_near"
    return (make_reason(code, skew_s=skew.value, limit_s=limit),)


def nearly_in_time(result: DropResult, limit: float) -> bool:
    """Whether a drop is void only for its release skew, by less than its uncertainty."""
    if result.verdict != "void":
        return False
    if {why.code for why in _by_severity(result.reasons)[0]} != {"release_skew"}:
        return False
    skew = result.quantities[RELEASE_SKEW.name]
    return abs(skew.value) - skew.expanded < limit


def _doubts(protocol: Protocol, drop: Drop, estimate: Estimate) -> Iterator[Reason]:
    """Yield remarks about a fit and the device's certificate."""
    if estimate.scatter > RESTLESS:
        yield make_reason("scatter", factor=estimate.scatter)
    if not estimate.settled:
        yield make_reason("not_converged", protocol.vocabulary)
    device, edges = drop.certificate, max(1, len(drop.edges))
    if device is not None and device.late > LATE * edges:
        yield make_reason("late_stamps", edges=device.late)
    # A pulse too short to be timed may be a missed edge.
    if device is not None and device.glitches > MISSED * edges:
        yield make_reason("short_pulses", pulses=device.glitches)


def _air(fit: Fit) -> dict[str, tuple[Reason, ...]]:
    """Return reasons about the fitted drag, by code; each is empty if drag is plausible.

    ``air``: κ differs from the stated value. ``air_implausible``: κ is far from its prior and the
    edges still do not fit, so that this is no fall. ``air_accelerates``: κ is negative, which is
    not physical, so that some input is wrong.
    """
    model, estimate = fit.model, fit.estimate
    at = model.unknowns["drag"].start
    off, sd = float(estimate.x[at]), float(estimate.sd[at])
    kappa = float(model.kappa(estimate.x))
    variance = float(estimate.inverse[at] @ estimate.inverse[at])
    u = math.sqrt(variance) * sd
    # Estimate by the edges alone, without the prior.
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

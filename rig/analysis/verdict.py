"""Verdict on a drop, by limits that are fixed before any result is seen."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping

from rig.analysis.chain_records import MISSED, SIDES
from rig.analysis.diagnoses import gate_reasons
from rig.analysis.distributions import most_by_chance
from rig.analysis.edge_classes import UnmatchedEdge
from rig.analysis.equations import HUBER, STRAY
from rig.analysis.fit import Fit
from rig.analysis.identify import RESTLESS
from rig.analysis.inclines import other_incline
from rig.analysis.last_passages import APART, disagreements
from rig.analysis.result import Audit, DropResult, Measured, Verdict
from rig.measurands import RELEASE_SKEW
from rig.protocol.protocol import Protocol, Run
from rig.reasons import Reason, Severity, make_reason
from rig.records import Drop

LATE = 0.2
"""Share of possibly late stamps, close after another stamp, above which a remark is made. Sixteen
gates passed at 5 m/s have 5 % by chance; four times that is noise on a wire."""


def verdict_of(reasons: Iterable[Reason]) -> Verdict:
    """Return the verdict by the most severe reason."""
    severity = max((reason.severity for reason in reasons), default=Severity.REMARK)
    verdicts: dict[Severity, Verdict] = {Severity.VOID: "void", Severity.DOUBT: "marginal"}
    return verdicts.get(severity, "accepted")


def judge_record(drop: Drop, audit: Audit) -> tuple[Reason, ...]:
    """Return reasons why a record cannot be analysed; empty if it can."""
    faults = {reason.code: reason for reason in drop.faults}
    if audit.lost:
        faults.setdefault("edges_lost", make_reason("edges_lost", lost=audit.lost))
    return tuple(faults.values())


def judge(
    fit: Fit,
    run: Run,
    drop: Drop,
    audit: Audit,
    values: Mapping[str, Measured],
    by_passages: Mapping[str, Measured],
    unmatched: Collection[UnmatchedEdge],
) -> tuple[Reason, ...]:
    """Return all reasons about a fitted drop, the most severe first.

    Parameters
    ----------
    by_passages
        Measurands from the last passages alone.
    unmatched
        Edges that are missing or belong to no rod.
    """
    protocol = fit.model.protocol
    reasons = [*judge_record(drop, audit), *_counts(protocol, audit)]
    reasons += [*release_reasons(protocol, values), *_air(fit)]
    # With wrong drag, the fit says nothing about the gates.
    is_air = any(reason.code == "air" for reason in reasons)
    reasons += [why for why in gate_reasons(fit) if not is_air or why.severity < Severity.VOID]
    if verdict_of(reasons) != "void":  # else all this may be the consequence
        reasons += [*_doubts(fit, drop, unmatched), *disagreements(values, by_passages)]
        # A drop whose α differs from the model's is still good: that is a result.
        reasons += other_incline(fit, run)
    return tuple(sorted(reasons, key=lambda reason: -reason.severity))


def _counts(protocol: Protocol, audit: Audit) -> Iterator[Reason]:
    """Yield reasons for missed or unexplained edges above the protocol's limits.

    With few edges, a single edge is a large share. So a rig with the usual rate of misses must not
    lose more than 1 drop in 1000 by chance, and a single stray pulse is tolerated.
    """
    accept, words = protocol.accept, protocol.vocabulary
    missed, expected, limit = audit.missed, audit.edge_count, accept.missed_edges
    if missed > limit * expected:
        chance = most_by_chance(expected, min(MISSED, limit / 2.0))
        code = "edges_missed" if missed > chance else "edges_missed_few"
        yield make_reason(code, words, missed=missed, expected=expected, limit=limit)
    surplus, received, limit = audit.unexplained, audit.received, accept.unexplained_edges
    if surplus > limit * received:
        code = "edges_unexplained" if surplus > SIDES else "edges_unexplained_few"
        yield make_reason(code, words, unexplained=surplus, received=received, limit=limit)


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
    if result.verdict != "void" or is_wrong(result.reasons):
        return False
    skew = result.quantities[RELEASE_SKEW.name]
    return abs(skew.value) - skew.expanded < limit


def is_wrong(reasons: Iterable[Reason]) -> bool:
    """Whether a drop is void for more than its release skew, which other gates would not mend."""
    void = {reason.code for reason in reasons if reason.severity is Severity.VOID}
    return bool(void - {"release_skew"})


def _doubts(fit: Fit, drop: Drop, unmatched: Collection[UnmatchedEdge]) -> Iterator[Reason]:
    """Yield remarks about a fit, the device's certificate, and edges after the passage."""
    estimate, words = fit.estimate, fit.model.protocol.vocabulary
    if estimate.scatter > RESTLESS:
        yield make_reason("scatter", factor=estimate.scatter)
    if not estimate.settled:
        yield make_reason("not_converged", words)
    device, edges = drop.certificate, max(1, len(drop.edges))
    if device and device.late > LATE * edges:
        yield make_reason("late_stamps", edges=device.late)
    # A pulse too short to be timed may be a missed edge.
    if device and device.glitches > MISSED * edges:
        yield make_reason("short_pulses", pulses=device.glitches)
    if later := sum(edge.kind == "later passage" for edge in unmatched):
        yield make_reason("later_passages", words, edges=later)


def _air(fit: Fit) -> Iterator[Reason]:
    """Yield reasons about the fitted drag, unless it is plausible."""
    model, estimate, words = fit.model, fit.estimate, fit.model.protocol.vocabulary
    at = model.unknowns["drag"].start
    off, sd = float(estimate.x[at]), float(estimate.sd[at])
    kappa = float(model.kappa(estimate.x))
    variance = float(estimate.inverse[at] @ estimate.inverse[at])
    u = math.sqrt(variance) * sd
    if model.protocol.drag is not None and abs(off) > STRAY * sd:
        # Estimate by the edges alone, without the prior.
        share = 1.0 / (1.0 - min(variance, 0.9))
        by_edges, u95 = kappa + (share - 1.0) * off, 2.0 * math.sqrt(share) * u
        yield make_reason("air", words, kappa=by_edges, U95=u95)
    if estimate.scatter > RESTLESS and abs(off) > APART * sd:  # this is no fall
        yield make_reason("air_implausible", words, kappa=kappa, factor=estimate.scatter)
    if kappa < -HUBER * u:  # negative drag is not physical, so that some input is wrong
        yield make_reason("air_accelerates", words, kappa=kappa, U95=2.0 * u)

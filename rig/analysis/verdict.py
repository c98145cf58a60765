"""Is a drop good? By limits that were fixed before any result was seen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.diagnoses import diagnose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.analysis.adjust import Estimate
    from rig.analysis.fit import Fit
    from rig.analysis.pattern import Guess
    from rig.analysis.result import Audit, Measured, Verdict
    from rig.protocol.protocol import Protocol
    from rig.records import Drop

SUPPORT = 0.6
"""Share of the expected edges that must be where the first guess puts them."""
LEAD = 0.1
"""By how much that share must exceed the best really different guess."""
RESTLESS = 2.0
"""Scatter of the edges about the adjusted motion, relative to the assumed one, that is remarked."""

LATE = 0.2
"""Share of stamps so close behind another that they may be late which a drop may have without
remark. Sixteen gates passed at 5 m/s have 5 % by chance; four times that is noise on a wire."""

_SURE = 4.0  # standard uncertainties

GLITCHES = 0.02
"""Pulses too short to be timed, relative to the edges, that a drop may have without remark."""


class Judgement(NamedTuple):
    """The verdict and why."""

    verdict: Verdict
    reasons: tuple[str, ...]


def judge(
    protocol: Protocol,
    drop: Drop,
    guesses: Mapping[str, Guess],
    audit: Audit,
    found: Mapping[str, Measured],
    fit: Fit | None,
) -> Judgement:
    """Judge a drop; without a `fit`, only whether it can be analysed at all."""
    void = [*drop.faults]
    doubts: list[str] = []
    if audit.lost:
        void.append(f"the device lost {audit.lost} edges: its memory was full")
    for role, guess in guesses.items():
        void += pattern_faults(role, guess)
    if fit is not None:
        faults = diagnose(fit)
        void += _limits(protocol, audit, found)
        void += faults.void
        if void:
            void += faults.doubts  # which may be why
        doubts += faults.doubts
        doubts += _doubts(protocol, drop, found, fit.estimate)
        doubts += _pushed(fit)
    if void:
        return Judgement("void", tuple(void))
    return Judgement("marginal" if doubts else "accepted", tuple(doubts))


def pattern_faults(role: str, guess: Guess) -> list[str]:
    """Say why the edges of a side are not one fall of its chain; nothing where they are."""
    if guess.share < SUPPORT:
        return [
            f"the {role} side does not look like this chain falling: only {guess.share:.0%} of "
            "the expected edges are where one fall would put them"
        ]
    if guess.share - guess.runner_up < LEAD:
        return [
            f"the {role} side is ambiguous: {guess.share:.0%} of the expected edges fit one fall, "
            f"{guess.runner_up:.0%} a different one"
        ]
    return []


def _limits(protocol: Protocol, audit: Audit, found: Mapping[str, Measured]) -> list[str]:
    """Return what is beyond the protocol's ``accept``."""
    accept = protocol.accept
    void = []
    expected = audit.matched + audit.missed
    if expected and audit.missed > accept.missed_edges * expected:
        void.append(
            f"{audit.missed} of {expected} edges missed ({audit.missed / expected:.1%}), "
            f"more than {accept.missed_edges:.1%}"
        )
    skew = found.get("release_skew_s")
    if skew is not None and abs(skew.value) > accept.release_skew:
        void.append(
            f"release skew {skew.value * 1e3:.2f} ms is beyond {accept.release_skew * 1e3:g} ms"
        )
    return void


def _doubts(
    protocol: Protocol, drop: Drop, found: Mapping[str, Measured], estimate: Estimate
) -> list[str]:
    """Return what makes a drop marginal."""
    doubts = []
    skew = found.get("release_skew_s")
    limit = protocol.accept.release_skew
    if skew is not None and abs(skew.value) + skew.expanded > limit >= abs(skew.value):
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

"""Joint fit of several sessions: unknowns of the same rig are shared, others are not.

The fit starts from each session's own joint fit. Two sessions share an unknown if they have the
same rig and their protocols agree about its owner: the posts, the beams, a chain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rig.analysis.components import priors
from rig.analysis.fit import Fit
from rig.analysis.joint_fit import JointFit
from rig.analysis.joint_step import JointDrop
from rig.analysis.result import DropResult, Measured
from rig.analysis.session import Analysis, fit_together, sum_up
from rig.analysis.summary import Incline, summarize
from rig.protocol.protocol import Protocol
from rig.reasons import rig_error
from rig.threads import one_thread

Key = tuple[int, tuple[int, int]]
Drops = dict[Key, Fit | JointDrop]


@dataclass(frozen=True, slots=True)
class SessionPart:
    """A session of a joint fit.

    Attributes
    ----------
    name
        Unique name of the session.
    analysis
        Analysis of the session by itself.
    board
        Unique id of its board; empty if unknown.
    """

    name: str
    protocol: Protocol
    analysis: Analysis
    board: str = ""


@dataclass(frozen=True, slots=True)
class SessionsFit:
    """Result of a joint fit of several sessions.

    Attributes
    ----------
    parts
        The sessions with their analysis from the joint fit.
    joint
        The joint fit; `None` if there are too few good drops.
    pooled
        Means over all sessions of a scene, by their names.
    shared
        Names of the sessions that share the owner of the key, a list for each rig.
    """

    parts: tuple[SessionPart, ...]
    joint: JointFit | None
    pooled: Mapping[tuple[str, ...], Sequence[Incline]]
    shared: Mapping[str, Sequence[Sequence[str]]]


def same_owners(
    parts: Sequence[SessionPart], *, same_rig: bool | None
) -> dict[str, list[list[str]]]:
    """Group sessions by the owners of unknowns that they share.

    Parameters
    ----------
    same_rig
        Whether all sessions have the same rig; if `None`, those with the same protocol title and
        the same board, if known.

    Returns
    -------
    dict
        For ``rig``, ``posts``, ``beams``, ``start``, ``condition`` and each ``chain NAME`` the
        names of the sessions that share this owner, a list for each group.
    """
    owners: dict[str, dict[tuple[object, str], list[str]]] = {}
    for place, part in enumerate(parts):
        by_name = (part.protocol.title, part.board)
        rig: object = by_name if same_rig is None else same_rig or place
        for owner, statement in _statements(part.protocol).items():
            owners.setdefault(owner, {}).setdefault((rig, repr(statement)), []).append(part.name)
    return {owner: list(groups.values()) for owner, groups in owners.items()}


def _statements(protocol: Protocol) -> dict[str, object]:
    """Return a protocol's statements about the owner of each shared unknown."""
    gates, chains = protocol.gates, protocol.chains
    assert gates is not None
    beams = [(gate.channel, gate.height, gate.side) for gate in gates.gates]
    scene = (chains, protocol.surface, protocol.contact, protocol.drop)
    return {
        "rig": (protocol.gravity, protocol.drag, protocol.track, protocol.reference_u),
        "posts": (gates.posts, gates.datum_u),
        "beams": (beams, gates.height_u),
        "start": protocol.drop,
        "condition": scene,
        **{f"chain {name}": chain for name, chain in chains.items()},
    }


@one_thread
def fit_sessions(parts: Sequence[SessionPart], *, same_rig: bool | None = None) -> SessionsFit:
    """Fit all good drops of several sessions together.

    Parameters
    ----------
    same_rig
        As for `same_owners`.

    Raises
    ------
    InputError
        The sessions' scenes are of different kinds, or their drops fit no common rig.
    """
    first = parts[0]
    kinds = [(part.protocol.vocabulary.scene, priors(part.protocol)) for part in parts]
    for part, kind in zip(parts, kinds, strict=True):
        if kind != kinds[0]:
            raise rig_error("sessions_unlike", path=part.name, other=first.name)
    shared = same_owners(parts, same_rig=same_rig)
    drops = _own(parts, shared)
    together = fit_together(
        {
            (place, (member.run.number, member.attempt)): replace(
                member, quantities=_strip_shared(member.quantities)
            )
            for place, part in enumerate(parts)
            for member in part.analysis.drops
        },
        drops,
    )
    if not together.settled:
        names = ", ".join(part.name for part in parts)
        raise rig_error("sessions_disagree", names=names)
    results: list[list[DropResult]] = [[] for _ in parts]
    for (place, _), result in together.results.items():
        results[place].append(result)
    fitted = tuple(
        replace(part, analysis=sum_up(part.protocol, members, part.analysis.joint))
        for part, members in zip(parts, results, strict=True)
    )
    return SessionsFit(fitted, together.joint, _pool_sessions(fitted), shared)


def _strip_shared(quantities: Mapping[str, Measured]) -> dict[str, Measured]:
    """Return quantities without a session's own covariances, which refer to other unknowns."""
    return {name: replace(value, shared=None, deviation=None) for name, value in quantities.items()}


def _own(parts: Sequence[SessionPart], shared: Mapping[str, Sequence[Sequence[str]]]) -> Drops:
    """Return the good drops, each with the name suffixes of its session's shared unknowns."""
    suffixes: dict[str, dict[str, str]] = {part.name: {} for part in parts}
    for owner, groups in shared.items():
        for group in groups:
            # Unknowns that all sessions share keep their names.
            suffix = "" if len(group) == len(parts) else f" ({', '.join(group)})"
            for name in group:
                suffixes[name][owner] = suffix
    return {
        (place, job): replace(fit, model=fit.model.copy_with(owners=suffixes[part.name]))
        for place, part in enumerate(parts)
        for job, fit in part.analysis.adjusted.items()
    }


def _pool_sessions(parts: Sequence[SessionPart]) -> dict[tuple[str, ...], list[Incline]]:
    """Return means over all sessions with the same predictions, by their names."""
    scenes: dict[str, list[SessionPart]] = {}
    for part in parts:
        own = part.protocol
        scene = (own.chains, own.surface, own.contact, own.drop, own.gravity, own.drag)
        scenes.setdefault(repr((*scene, own.track, own.initial_speed)), []).append(part)
    return {
        tuple(part.name for part in alike): summarize(
            alike[0].protocol, [run for part in alike for run in part.analysis.runs]
        )
        for alike in scenes.values()
    }

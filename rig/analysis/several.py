"""Several sessions fitted together: what is the same rig is one unknown, the rest is not.

Each session's own joint fit is where the fit of all begins. A common unknown of two sessions is one
if both have the same rig and state alike what the unknown is about: the posts, the beams, a chain.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rig.analysis.components import stated
from rig.analysis.session import fit_together, sum_up
from rig.analysis.summary import summarize
from rig.errors import InputError
from rig.reasons import make_error
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.fit import Fit
    from rig.analysis.joint_fit import JointFit
    from rig.analysis.joint_step import JointDrop
    from rig.analysis.result import DropResult, Measured
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.protocol.protocol import Protocol

    Key = tuple[int, tuple[int, int]]
    Drops = dict[Key, Fit | JointDrop]


@dataclass(frozen=True, slots=True)
class SessionPart:
    """A session among others.

    Attributes
    ----------
    name
        Of the session, told from the others.
    analysis
        What the session says by itself.
    board
        Unique id of its board; empty where none is known.
    """

    name: str
    protocol: Protocol
    analysis: Analysis
    board: str = ""


@dataclass(frozen=True, slots=True)
class PooledMeans:
    """Means over all sessions of one scene, and the names of these."""

    sessions: tuple[str, ...]
    summary: tuple[Incline, ...]


@dataclass(frozen=True, slots=True)
class SessionsFit:
    """What several sessions say together.

    Attributes
    ----------
    parts
        Each with its analysis in the light of all.
    joint
        `None` where there are too few good drops.
    pooled
        Means over sessions of like scenes.
    shared
        Names of the sessions that have in common what the key names, one list a rig.
    """

    parts: tuple[SessionPart, ...]
    joint: JointFit | None
    pooled: tuple[PooledMeans, ...]
    shared: Mapping[str, Sequence[Sequence[str]]]


def same_owners(
    parts: Sequence[SessionPart], *, same_rig: bool | None
) -> dict[str, list[list[str]]]:
    """Sort sessions by what they have in common.

    Parameters
    ----------
    same_rig
        Whether all have the same rig; if `None`, those whose protocols have the same title, and
        whose boards, where known, are the same.

    Returns
    -------
    dict
        For ``rig``, ``posts``, ``beams``, ``start``, ``condition`` and each ``chain NAME`` the
        names of those sessions that have it in common, one list a rig.
    """
    owners: dict[str, dict[tuple[object, str], list[str]]] = {}
    for place, part in enumerate(parts):
        by_name = (part.protocol.title, part.board)
        rig: object = by_name if same_rig is None else same_rig or place
        for owner, statement in _statements(part.protocol).items():
            owners.setdefault(owner, {}).setdefault((rig, repr(statement)), []).append(part.name)
    return {owner: list(groups.values()) for owner, groups in owners.items()}


def _statements(protocol: Protocol) -> dict[str, object]:
    """What a protocol states of the owner of each common unknown."""
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
    for part in parts[1:]:
        kinds = [
            (member.protocol.vocabulary.scene, stated(member.protocol)) for member in (first, part)
        ]
        if kinds[0] != kinds[1]:
            raise make_error(InputError, "sessions_unlike", path=part.name, other=first.name)
    shared = same_owners(parts, same_rig=same_rig)
    drops = _own(parts, shared)
    together = fit_together(
        {
            (place, (member.run.number, member.attempt)): replace(
                member, quantities=_unshared(member.quantities)
            )
            for place, part in enumerate(parts)
            for member in part.analysis.drops
        },
        drops,
    )
    if not together.settled:
        names = ", ".join(part.name for part in parts)
        raise make_error(InputError, "sessions_disagree", names=names)
    results: list[list[DropResult]] = [[] for _ in parts]
    for (place, _), result in together.results.items():
        results[place].append(result)
    fitted = tuple(
        replace(part, analysis=sum_up(part.protocol, members, part.analysis.joint))
        for part, members in zip(parts, results, strict=True)
    )
    return SessionsFit(fitted, together.joint, _pooled(fitted), shared)


def _unshared(quantities: Mapping[str, Measured]) -> dict[str, Measured]:
    """Leave out what a session's own fit says of covariances: their unknowns are others."""
    return {name: replace(value, shared=None, deviation=None) for name, value in quantities.items()}


def _own(parts: Sequence[SessionPart], shared: Mapping[str, Sequence[Sequence[str]]]) -> Drops:
    """Return the good drops, each with the names of its session's common unknowns."""
    suffixes: dict[str, dict[str, str]] = {part.name: {} for part in parts}
    for owner, groups in shared.items():
        for group in groups:
            # What all have in common keeps the name that it has in one session.
            suffix = "" if len(group) == len(parts) else f" ({', '.join(group)})"
            for name in group:
                suffixes[name][owner] = suffix
    return {
        (place, job): replace(fit, model=fit.model.changed(owners=suffixes[part.name]))
        for place, part in enumerate(parts)
        for job, fit in part.analysis.adjusted.items()
    }


def _pooled(parts: Sequence[SessionPart]) -> tuple[PooledMeans, ...]:
    """Average over all sessions of which the model says the same."""
    scenes: dict[str, list[SessionPart]] = {}
    for part in parts:
        own = part.protocol
        scene = (own.chains, own.surface, own.contact, own.drop, own.gravity, own.drag)
        scenes.setdefault(repr((*scene, own.track, own.initial_speed)), []).append(part)
    return tuple(
        PooledMeans(
            tuple(part.name for part in alike),
            tuple(summarize(alike[0].protocol, [r for part in alike for r in part.analysis.runs])),
        )
        for alike in scenes.values()
    )

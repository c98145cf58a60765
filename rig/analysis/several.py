"""Joint fit of several sessions: unknowns of the same rig are shared, others are not.

The fit starts from each session's own joint fit. Two sessions share an unknown if they have the
same rig and their protocols agree about its owner: the posts, the beams, a chain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rig.analysis.components import priors
from rig.analysis.session import Analysis, SessionDrops, fit_sessions
from rig.analysis.summary import Incline, summarize
from rig.protocol.protocol import Protocol
from rig.reasons import rig_error
from rig.threads import one_thread


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
def fit_parts(
    parts: Sequence[SessionPart], shared: Mapping[str, Sequence[Sequence[str]]]
) -> tuple[SessionPart, ...]:
    """Fit all good drops of several sessions together.

    Parameters
    ----------
    shared
        Names of the sessions that share each owner, from `same_owners`.

    Returns
    -------
    tuple of SessionPart
        The sessions with their analysis from the joint fit.

    Raises
    ------
    InputError
        The sessions' scenes are of different kinds, or their drops fit no common rig.
    """
    kinds = [(part.protocol.vocabulary.scene, priors(part.protocol)) for part in parts]
    for part, kind in zip(parts, kinds, strict=True):
        if kind != kinds[0]:
            raise rig_error("sessions_unlike", path=part.name, other=parts[0].name)
    analyses = fit_sessions([_with_owners(part, shared, len(parts)) for part in parts])
    if any(analysis.unsettled for analysis in analyses):
        raise rig_error("sessions_disagree", names=", ".join(part.name for part in parts))
    fitted = zip(parts, analyses, strict=True)
    return tuple(replace(part, analysis=analysis) for part, analysis in fitted)


def _with_owners(
    part: SessionPart, shared: Mapping[str, Sequence[Sequence[str]]], count: int
) -> SessionDrops:
    """Return a session's drops, good ones with the name suffixes of their shared unknowns."""
    owners = {  # unknowns that all sessions share keep their names
        owner: "" if len(group) == count else f" ({', '.join(group)})"
        for owner, groups in shared.items()
        for group in groups
        if part.name in group
    }
    fits = {
        job: replace(fit, model=fit.model.copy_with(owners=owners))
        for job, fit in part.analysis.adjusted.items()
    }
    results = {(drop.run.number, drop.attempt): drop for drop in part.analysis.drops}
    return SessionDrops(part.protocol, results, fits)


def pool_means(parts: Sequence[SessionPart]) -> dict[tuple[str, ...], list[Incline]]:
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

"""Owners of shared unknowns: what a protocol states of each.

Where two protocols state the same of an owner, its unknowns may be the same.
"""

from __future__ import annotations

from rig.protocol.protocol import Protocol, Run


def statements(protocol: Protocol) -> dict[str, object]:
    """Return a protocol's statements about the owner of each shared unknown.

    Returns
    -------
    dict
        For ``rig``, ``posts``, ``beams``, ``start``, ``condition`` and each ``chain NAME``.
    """
    gates, chains = protocol.gates, protocol.chains
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


def suffixes(protocol: Protocol, run: Run) -> dict[str, str]:
    """Return suffixes of the names of unknowns that a run's setting does not share with others.

    A condition's own name has the setting.
    """
    common, own = statements(protocol), statements(protocol.of(run)).items()
    varied = [owner for owner, statement in own if statement != common[owner]]
    return {owner: f" ({run.setting})" for owner in varied if owner != "condition"}

"""Owners of shared unknowns: what a protocol states of each.

Where two protocols state the same of an owner, its unknowns may be the same.
"""

from rig.protocol.protocol import Protocol, Run


def statements(protocol: Protocol) -> dict[str, object]:
    """Return a protocol's statements about the owner of each shared unknown.

    Returns
    -------
    dict
        For ``rig``, ``air``, ``posts``, ``beams``, ``start``, ``condition``, and ``chain NAME`` of
        each chain.
    """
    gates, chains = protocol.gates, protocol.chains
    beams = [(gate.channel, gate.height, gate.side) for gate in gates.gates]
    scene = (chains, protocol.surface, protocol.contact, protocol.drop)
    return {
        "rig": protocol.reference_u,
        "air": (protocol.gravity, protocol.drag, protocol.track),
        "posts": (gates.posts, gates.datum_u),
        "beams": (beams, gates.height_u),
        "start": protocol.drop,
        "condition": scene,
        **{f"chain {name}": chain for name, chain in chains.items()},
    }


def suffixes(protocol: Protocol, run: Run) -> dict[str, str]:
    """Return suffixes of the names of unknowns that not all settings of a plan share.

    They name the first setting that states the same of an owner; a condition's name has its own.
    """
    scenes = {at: statements(protocol.settings[at]) for at in protocol.variants}
    suffixes = {}
    for owner, statement in scenes.get(run.setting, {}).items():
        first = next(at for at, scene in scenes.items() if scene[owner] == statement)
        if owner != "condition" and first != next(iter(scenes)):
            suffixes[owner] = f" ({first})"
    return suffixes

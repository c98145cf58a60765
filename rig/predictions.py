"""From a protocol to what the model expects of it, loading only the mechanics its scene has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.protocol.scene import Protocol, RodChain


def predictions(protocol: Protocol) -> list[dict[str, Any]]:
    """Predict each incline of the plan; where chains are unlike, the first one strikes.

    Returns
    -------
    list of dict
        As ``rig predict --json`` prints them, one an incline; one alone where nothing is struck.
    """
    return [_free_fall(protocol)] if protocol.surface is None else _impacts(protocol)


def notes(protocol: Protocol) -> list[str]:
    """Every note on a planned incline, the same ones of several inclines together."""
    at: dict[str, list[str]] = {}
    for one in predictions(protocol):
        for note in one["notes"]:
            at.setdefault(note, []).append(f"{one['incline_deg']:g}°")
    return [f"{', '.join(inclines)}: {note}" for note, inclines in at.items()]


def _free_fall(protocol: Protocol) -> dict[str, Any]:
    """Predict the fall of a chain that strikes nothing."""
    (rods,) = protocol.chains.values()
    drop, gravity, start = (
        each.value for each in (protocol.drop, protocol.gravity, protocol.initial_speed)
    )
    if protocol.drag is None:
        from rig.model.fall import free_fall  # noqa: PLC0415 - all that this scene needs

        speed, time = free_fall(rods.chain, drop, gravity, start)
    else:
        from rig.model.drag import drag_leg  # noqa: PLC0415 - only where there is air

        kappa = _kappas(protocol, rods)[0]
        speed, time = drag_leg(drop + rods.chain.length, start, gravity, kappa)
    return {
        "incline_deg": 0.0,
        "model": "free fall" if protocol.drag is None else "free fall, drag",
        "alpha": None,
        "gamma": None,
        "separation_m": None,
        "speed_m_s": speed,
        "fall_time_s": time,
        "free_fall_speed_m_s": speed,
        "in_domain": True,
        "notes": [],
    }


def _impacts(protocol: Protocol) -> list[dict[str, Any]]:
    """Predict the fall of a chain that strikes a surface, incline by incline."""
    from rig.model.predict import predict  # noqa: PLC0415 - only where something is struck

    assert protocol.surface is not None
    first, *others = protocol.chains.values()
    kappas = _kappas(protocol, first)
    other = others[0] if others else first
    its_kappas = _kappas(protocol, other) if others else kappas
    unlike = other.chain != first.chain or its_kappas != kappas
    found = []
    for incline in dict.fromkeys(protocol.plan.inclines):
        one = predict(
            first.chain,
            protocol.surface,
            incline,
            protocol.drop,
            protocol.gravity,
            initial_speed=protocol.initial_speed,
            kappas=kappas,
            drag_u=0.0 if protocol.drag is None else protocol.drag.relative_u,
        )
        notes, separation = list(one.notes), one.separation
        if unlike:
            notes.append(f"chains are unlike: {first.name} strikes")
            if separation is not None and one.time is not None:
                separation += other.chain.length - first.chain.length
                separation += _held_back(protocol, kappas, its_kappas, one.time)
        found.append(
            {
                "incline_deg": incline,
                "model": one.model,
                "alpha": one.alpha,
                "gamma": one.gamma,
                "separation_m": separation,
                "separation_u_m": one.separation_u,
                "speed_m_s": one.speed,
                "speed_u_m_s": one.speed_u,
                "fall_time_s": one.time,
                "free_fall_speed_m_s": one.free_fall_speed,
                "in_domain": one.in_domain,
                "notes": notes,
            }
        )
    return found


def _kappas(protocol: Protocol, rods: RodChain) -> list[float]:
    """κ on the leg before each impact, 1/m; empty without air."""
    if protocol.drag is None:
        return []
    from rig.model.drag import cylinder_drag, leg_drags  # noqa: PLC0415 - only where there is air

    drag = protocol.drag
    if drag.terminal_speed is not None:
        return [protocol.gravity.value / drag.terminal_speed.value**2] * rods.chain.rods
    assert drag.coefficient is not None
    return leg_drags(
        rods.chain,
        [
            cylinder_drag(
                drag.coefficient.value, drag.air_density, diameter, rods.rod_length, rods.tilt_deg
            )
            for diameter in rods.diameters
        ],
    )


def _held_back(
    protocol: Protocol, kappas: Sequence[float], its_kappas: Sequence[float], time: float
) -> float:
    """How much less far the free chain falls than the first one would beside it, m."""
    if kappas[:1] == its_kappas[:1]:
        return 0.0
    from rig.model.drag import fallen  # noqa: PLC0415 - only where there is air

    gravity, start = protocol.gravity.value, protocol.initial_speed.value
    way, its_way = (fallen(time, gravity, each[0], start) for each in (kappas, its_kappas))
    return way - its_way

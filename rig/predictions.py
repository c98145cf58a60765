"""What the model expects of a protocol's scene: the one predictor, with and without air.

Mechanics that a scene does not have are not loaded.
"""

from collections.abc import Mapping
from dataclasses import replace

from rig.measurands import ACCELERATION, FALL_TIME, GRAVITY, SEPARATION, SPEED
from rig.model.prediction import PredictedIncline, group_notes, predict_free_fall
from rig.protocol.contact import as_struck, at_contact
from rig.protocol.protocol import Protocol, RodChain, Run
from rig.units import Quantity


def predictions(protocol: Protocol) -> list[PredictedIncline]:
    """Predict each incline and setting of the plan and, where chains are unlike, each that strikes.

    One alone where nothing is struck.
    """
    scenes = protocol.settings.items()
    return [replace(line, setting=at) for at, scene in scenes for line in _predict_scene(scene)]


def _predict_scene(protocol: Protocol) -> list[PredictedIncline]:
    if protocol.surface is None:
        ((name, rods),) = protocol.chains.items()
        scene = "free fall" if protocol.track is None else "track"
        length = protocol.drop.value + rods.chain.length
        gravity, start = protocol.gravity.value, protocol.initial_speed.value
        return [predict_free_fall(scene, length, gravity, start, air_of(protocol, name))]
    inclines, unlike = dict.fromkeys(protocol.plan.inclines), protocol.unlike_chains
    return [
        replace(predict_incline(protocol, at, struck), impact_chain=struck if unlike else None)
        for at in inclines
        for struck in protocol.strikers
    ]


def predict_incline(protocol: Protocol, incline_deg: float, struck: str) -> PredictedIncline:
    """Predict the fall of a chain that strikes a surface, beside one that does not.

    Parameters
    ----------
    protocol
        With a surface.
    struck
        Name of the chain; where there is no other one, Δz is from its twin.
    """
    from rig.model.predict import predict  # noqa: PLC0415 - only where something is struck

    protocol = at_contact(protocol, incline_deg, struck)
    assert protocol.surface is not None
    chain, drop = as_struck(protocol, incline_deg, struck)
    kappas = air_of(protocol, struck)
    model = predict(
        *(chain, protocol.surface, incline_deg, drop, protocol.gravity),
        initial_speed=protocol.initial_speed,
        kappas=kappas,
        drag_u=0.0 if protocol.drag is None else protocol.drag.relative_u,
    )
    free = next((name for name in protocol.chains if name != struck), None)
    if free is None or model.separation_m is None or model.fall_time_s is None:
        return model
    # Top rods of unlike chains start at unlike heights, and the air holds them back unlike.
    longer = protocol.chains[free].chain.length - protocol.chains[struck].chain.length
    higher, free_kappas = 0.0, air_of(protocol, free)
    if kappas != free_kappas:
        from rig.model.drag import fallen  # noqa: PLC0415 - only where there is air

        gravity, start = protocol.gravity.value, protocol.initial_speed.value
        way, free_way = (
            fallen(model.fall_time_s, gravity, air[0], start) for air in (kappas, free_kappas)
        )
        higher = way - free_way
    return replace(model, separation_m=model.separation_m + longer + higher)


def predicted_run(protocol: Protocol, run: Run) -> dict[str, Quantity]:
    """What the model says of one run, by JSON name; nothing where it has no answer."""
    protocol = protocol.of(run)
    if run.impact is None:
        row = GRAVITY if protocol.track is None else ACCELERATION
        return {row.name: protocol.gravity}
    model = predict_incline(protocol, run.incline_deg, run.impact)
    rows = (SEPARATION, SPEED, FALL_TIME) if run.free is not None else (SPEED, FALL_TIME)
    return model.quantities(*rows)


def coefficient_slopes(protocol: Protocol, run: Run) -> dict[str, Mapping[str, float]]:
    """Return by coefficient how much its standard uncertainty moves each prediction.

    What else a prediction is made from, measuring needs too: the drop's own equations know that.
    """
    protocol = protocol.of(run)
    if run.impact is None:
        return {"gravity": {name: g.u for name, g in predicted_run(protocol, run).items()}}
    from rig.model.impact import ALPHA  # noqa: PLC0415 - only where something is struck

    own = f"alpha {protocol.condition(run).impact_chain}"
    slopes = predict_incline(protocol, run.incline_deg, run.impact).slopes
    return {own if name == ALPHA else name: changes for name, changes in slopes.items()}


def notes(protocol: Protocol) -> list[str]:
    """Its author's notes, and those on planned inclines, the same of several together."""
    return [*protocol.notes.splitlines(), *group_notes(predictions(protocol))]


def air_of(protocol: Protocol, name: str) -> list[float]:
    """κ of a chain on the leg before each impact, 1/m; empty without air."""
    drag, rods = protocol.drag, protocol.chains[name]
    if drag is None:
        return []
    if drag.coefficient is None:
        assert drag.terminal_speed is not None
        return [protocol.gravity.value / drag.terminal_speed.value**2] * rods.chain.rods
    return _kappas(rods, rods.rod_length, (drag.coefficient.value, drag.air_density))


def air_shares(protocol: Protocol) -> dict[str, list[float]]:
    """κ of each chain on the leg before each impact, in units of the first chain's as it hangs.

    What the air takes goes with a rod's width over its mass, whatever the coefficient: of like
    material, and where masses are not given, with 1/diameter. Where widths are not known, or a
    terminal speed is stated, all are taken to be alike.
    """
    chains = protocol.chains.values()
    known = all(rods.diameters and min(rods.diameters) for rods in chains)
    if not known or (protocol.drag is not None and protocol.drag.coefficient is None):
        return {name: [1.0] * rods.chain.rods for name, rods in protocol.chains.items()}
    measured = all(rods.rod_length for rods in chains)
    weighed = measured and all(rods.weighed for rods in chains)
    shares = {
        name: _kappas(rods, rods.rod_length if measured else 1.0, (1.0, 1.0), weighed=weighed)
        for name, rods in protocol.chains.items()
    }
    first = next(iter(shares.values()))[0]
    return {name: [kappa / first for kappa in kappas] for name, kappas in shares.items()}


def _kappas(
    rods: RodChain, length: float, air: tuple[float, float], *, weighed: bool = True
) -> list[float]:
    """Width over mass of all rods from each one up, by the masses given or by those of volumes.

    Parameters
    ----------
    air
        Drag coefficient, and density.
    """
    from rig.model.drag import cylinder_drag, leg_drags  # noqa: PLC0415 - only where there is air

    drags = [cylinder_drag(*air, d, length, rods.tilt_deg) for d in rods.diameters]
    volumes = tuple(d * d * length for d in rods.diameters)
    return leg_drags(rods.chain if weighed else replace(rods.chain, masses=volumes), drags)

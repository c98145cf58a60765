"""``rig predict``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.commands.output import print_json
from rig.errors import InputError
from rig.model.fall import fall, free_fall_speed
from rig.model.predict import predict
from rig.protocol import reader

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.protocol.scene import Protocol


def main(arguments: Namespace) -> int:
    """Print the model's predictions, one an incline, or draw a figure of the paper."""
    if arguments.figure is not None:
        from rig.commands.paper_figure import write_figure  # noqa: PLC0415 - it needs matplotlib

        write_figure(arguments.figure, arguments.output)
        return 0
    if arguments.protocol is None:
        raise InputError("predict what?", "name a protocol file, or a --figure with -o FILE.svg")
    protocol = reader.read(arguments.protocol)
    found = predictions(protocol)
    if arguments.json:
        print_json({"predictions": found})
    else:
        print(table(found))
    return 0


def predictions(protocol: Protocol) -> list[dict[str, Any]]:
    """Predict each incline of the plan; where chains are unlike, the first one strikes."""
    first, *others = protocol.chains.values()
    chain = first.chain
    if protocol.surface is None:
        down = fall(chain, 0.0, 0.0, protocol.drop.value, protocol.gravity.value)
        free = free_fall_speed(chain, protocol.drop.value, protocol.gravity.value)
        return [
            {
                "incline_deg": 0.0,
                "model": "free fall",
                "alpha": None,
                "gamma": None,
                "separation_m": None,
                "speed_m_s": free,
                "fall_time_s": down.time_s,
                "free_fall_speed_m_s": free,
                "in_domain": True,
                "notes": [],
            }
        ]
    longer = others[0].chain.length - chain.length if others else 0.0
    found = []
    for incline in dict.fromkeys(protocol.plan.inclines):
        one = predict(chain, protocol.surface, incline, protocol.drop, protocol.gravity)
        notes = list(one.notes)
        if longer:
            notes.append(f"chains are unlike: {first.name} strikes")
        found.append(
            {
                "incline_deg": incline,
                "model": one.model,
                "alpha": one.alpha,
                "gamma": one.gamma,
                "separation_m": None if one.separation is None else one.separation + longer,
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


def table(found: list[dict[str, Any]]) -> str:
    """Lay predictions out as text, notes below."""
    columns = {
        "incline (°)": ("incline_deg", 1.0, "g"),
        "α": ("alpha", 1.0, ".4f"),
        "Δz (cm)": ("separation_m", 100.0, ".3f"),
        "u (cm)": ("separation_u_m", 100.0, ".3f"),
        "V (m/s)": ("speed_m_s", 1.0, ".4f"),
        "u (m/s)": ("speed_u_m_s", 1.0, ".4f"),
        "t (s)": ("fall_time_s", 1.0, ".5f"),
        "free fall V (m/s)": ("free_fall_speed_m_s", 1.0, ".4f"),
    }
    shown = {
        heading: what
        for heading, what in columns.items()
        if any(line.get(what[0]) is not None for line in found)
    }
    rows = [[*shown, "model"]]
    for line in found:
        cells = [
            "–" if line.get(key) is None else format(line[key] * scale, style)
            for key, scale, style in shown.values()
        ]
        rows.append([*cells, line["model"]])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    notes = [f"{line['incline_deg']:g}°: {note}" for line in found for note in line["notes"]]
    return "\n".join([*lines, *notes])

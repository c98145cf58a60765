"""Mounting drawing of emitters and receivers: posts from the side, board at its inclines, slots.

Rods hang along the level lines of the board, and a beam crosses them from front to back. So the
beam meets the board uphill, unless the board has a slot, or the uphill part is before the board.
"""

import math
from dataclasses import replace
from typing import Any

from rig.protocol.protocol import Gate, InclinedTrack, Protocol
from rig.report.figure import Chart, chart
from rig.report.templates import render

Point = tuple[float, float]

_SIDES = {"impact": (-1, "line", "second"), "free": (1, "dash", "model")}
_WIDTH_PT = 530.0
_NEAR_M = 0.16  # height of the enlarged detail
_POST_M = 0.12  # from the chains to the posts, as drawn
_LOW_M = -0.02  # shown below the zero
_MM = 1e3


def mounting_figure(protocol: Protocol) -> Chart:
    """Return the mounting drawing of a protocol's gates, of which there are some; in mm."""
    inclines = _inclines(protocol)
    if protocol.track is not None:
        figure = chart("track", _track(protocol, protocol.track), title=protocol.title)
    else:
        highest = max(gate.height for gate in protocol.gates.gates)
        hanging = protocol.drop.value + max(c.chain.length for c in protocol.chains.values())
        near = max(_NEAR_M, 1.5 * min(gate.height for gate in protocol.gates.gates))
        lowest = f"close to the {protocol.zero}" if inclines else "lowest gates"
        whole = "posts and beams, from the side"
        # Gates below are labelled in the other view, which has room.
        above = _side_view(protocol, 1.04 * max(highest, hanging), near, whole)
        below = _side_view(protocol, near, 0.0, lowest)
        figure = chart("mounting", above, below, title=protocol.title)
    known = {"protocol": protocol, "inclines": inclines, "ends": beam_ends}
    foot = str(render("mounting.txt", **known)).split("\n")
    return replace(figure, caption=figure.title, foot=foot, width=_WIDTH_PT)


def face_below(protocol: Protocol, incline_deg: float) -> float:
    """Return the depth of the board's face below the zero of the heights, m."""
    if protocol.contact.from_board:
        return 0.0  # heights are relative to the board
    thick = max((d for c in protocol.chains.values() for d in c.diameters), default=0.0)
    return thick / 2 / math.cos(math.radians(incline_deg))


def beam_ends(protocol: Protocol, height: float, incline_deg: float) -> tuple[float, float]:
    """Return where a beam meets the board.

    Parameters
    ----------
    protocol
        The scene.
    height
        Height of the beam above the contact point, m.
    incline_deg
        Inclination of the board, above 0.

    Returns
    -------
    float, float
        Horizontal distance uphill of the chain, m; distance along the board's face from the point
        under the chain, m.
    """
    slope = math.radians(incline_deg)
    rise = height + face_below(protocol, incline_deg)
    return rise / math.tan(slope), rise / math.sin(slope)


def _inclines(protocol: Protocol) -> list[float]:
    return sorted(set(protocol.plan.inclines)) if protocol.surface is not None else []


def _track(protocol: Protocol, track: InclinedTrack) -> dict[str, Any]:
    """Return a track from the side with its beams; all lengths are along the track from a mark."""
    slope, start = math.radians(track.incline_deg.value), protocol.drop.value

    def at(along: float, above: float = 0.0) -> Point:
        level = (start - along) * math.cos(slope) + above * math.sin(slope)
        return level, along * math.sin(slope) + above * math.cos(slope)

    tips = [at(gate.height, _POST_M) for gate in protocol.gates.gates]
    return {
        "incline": track.incline_deg.value,
        "true": True,
        "post": [at(1.05 * start), at(0.0)],
        "rods": [at(start)],
        "mark": [at(0.0)],
        "beams": [
            {"label": _name(gate), "ends": [at(gate.height), tip], "tip": [tip]}
            for gate, tip in zip(protocol.gates.gates, tips, strict=True)
        ],
    }


def _side_view(protocol: Protocol, top: float, named_above: float, title: str) -> dict[str, Any]:
    """Return the part below a height, to scale, with names of gates; uphill is to the right."""
    inclines = _inclines(protocol)
    post = _POST_M if top > 2 * _POST_M else top / 2
    chain = next(iter(protocol.chains.values()))
    beams, boards = [], []
    for place, incline in enumerate(inclines):
        away = top * (0.3 if place % 2 else 0.45)  # neighbours' names would overlap
        slope, face = math.radians(incline), face_below(protocol, incline)
        at = away * math.cos(slope), away * math.sin(slope) - face
        ends = [(y, y * math.tan(slope) - face) for y in (-0.5 * post, 1.2 * post)]
        name = "" if named_above else f"{incline:g}°"
        boards.append({"ends": ends, "label": name, "place": [at]})
    for gate in protocol.gates.gates:
        side, role, color = _SIDES[gate.side]
        if gate.height <= top:
            ends = [(end * post, gate.height) for end in (-side, side, 1.05 * side)]
            name = _name(gate) if gate.height >= named_above else ""
            look = {"role": role, "color": color, "label": name}
            beams.append({**look, "ends": ends[:2], "place": ends[2:]})
    return {
        "x": f"{title} ({'mm, uphill to the right' if inclines else 'mm'})",
        "y": f"mm {protocol.drop_from}" if inclines else "mm",
        "x_axis": {"limits": (-2.4 * _MM * post, 2.4 * _MM * post)},
        "y_axis": {"limits": (_MM * _LOW_M, _MM * top)},
        "true": True,
        "ground": [0.0],
        "boards": boards,
        "posts": [{"ends": [(x, _LOW_M), (x, top)]} for x in (-post, post)],
        "rods": [(0.0, protocol.drop.value + height) for height in chain.chain.heights],
        "mark": [(0.0, 0.0)],
        "beams": beams,
    }


def _name(gate: Gate) -> str:
    return f"{gate.channel}: {_MM * gate.height:g}"

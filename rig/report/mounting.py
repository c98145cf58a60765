"""Where emitters and receivers go: both posts from the side, the board at its inclines, the slots.

Rods hang along the level lines of the board, and a beam crosses them front to back: so it runs up
the slope and into the board, unless there is a slot, or its uphill part stands before the board.
"""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

from rig.report.canvas import INK, MODEL, MUTED, PAPER, PASSES, SECOND, annotate, canvas
from rig.text_table import text_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rig.protocol.protocol import Gate, Gates, InclinedTrack, Protocol, Side
    from rig.report.canvas import Canvas

_BEAMS: dict[Side, str] = {"impact": "full (impact chain)", "free": "dashed (free chain)"}
_COLOURS: dict[Side, str] = {"impact": SECOND, "free": MODEL}
_LEGEND = "At each beam: channel: height in mm."
_WIDTH_IN = 9.0
_WRAP = 100
_CAPTION = {"y": 1.0, "va": "top", "family": "DejaVu Sans Mono", "line": 0.195}
_NEAR_M = 0.16  # what is drawn larger once more
_POST_M = 0.12  # from the chains to the posts, as drawn


def mounting_figure(protocol: Protocol, gates: Gates) -> Canvas:
    """Draw how the gates of a protocol are mounted.

    Parameters
    ----------
    protocol
        The scene.
    gates
        Its gates.

    Returns
    -------
    Canvas
        Lengths are in mm.
    """
    if protocol.track is not None:
        return _track_figure(protocol, protocol.track, gates)
    inclines = _inclines(protocol)
    text = "\n".join(
        [protocol.title, _LEGEND, "", *_zero(protocol, gates), *_slots(protocol, gates)]
    )
    with canvas(
        (5.6,), _WIDTH_IN, simulated=False, columns=2, sharex=False,
        description=protocol.title, caption=text, caption_look={**_CAPTION, **PASSES},
    ) as drawing:  # fmt: skip
        whole, close = drawing.axes
        top = max(gate.height for gate in gates.gates)
        low = min(gate.height for gate in gates.gates)
        hanging = protocol.drop.value + max(c.chain.length for c in protocol.chains.values())
        near = max(_NEAR_M, 1.5 * low)
        # What lies below is named in the other view, where there is room.
        _side_view(whole, protocol, gates, 1.04 * max(top, hanging), named_above=near)
        whole.set_ylabel("")
        whole.set_title("posts and beams, from the side", loc="left")
        _side_view(close, protocol, gates, near)
        _name_inclines(close, protocol, 0.45 * near)
        close.set_title(f"close to the {protocol.zero}" if inclines else "lowest gates", loc="left")
    return drawing


def _track_figure(protocol: Protocol, track: InclinedTrack, gates: Gates) -> Canvas:
    """Draw a track from the side, with beams across it; all lengths are along it, from one mark."""
    slope = math.radians(track.incline_deg.value)
    text = "\n".join([
        protocol.title, _LEGEND, "",
        *textwrap.wrap("Lengths are measured along the track from one mark (x), such as its lower "
                  "end, to each beam and to the glider's middle before release.", _WRAP),
    ])  # fmt: skip
    with canvas(
        (3.0,), _WIDTH_IN, simulated=False, sharex=False,
        description=protocol.title, caption=text, caption_look=_CAPTION,
    ) as drawing:  # fmt: skip
        (side,) = drawing.axes
        start = protocol.drop.value

        def at(along: float, above: float = 0.0) -> tuple[float, float]:
            return (
                1e3 * ((start - along) * math.cos(slope) + above * math.sin(slope)),
                1e3 * (along * math.sin(slope) + above * math.cos(slope)),
            )

        side.plot(*zip(at(1.05 * start), at(0.0), strict=True), color=INK, linewidth=2.0)
        side.plot(*at(0.0), "x", color=INK)
        side.plot(*at(start), "o", color=INK)
        for gate in gates.gates:
            ends = at(gate.height), at(gate.height, _POST_M)
            side.plot(*zip(*ends, strict=True), color=MODEL, linewidth=0.9)
            annotate(side, _label(gate), ends[1], (0, 4), ha="center", color=MODEL)
        side.set_aspect("equal", adjustable="datalim")
        side.set_xlabel("mm")
        side.set_title(f"the track at {track.incline_deg.value:g}°, from the side", loc="left")
        side.grid(visible=False)
    return drawing


def face_below(protocol: Protocol, incline_deg: float) -> float:
    """How far the board's face is under the zero of the heights, m."""
    if protocol.contact.from_board:
        return 0.0  # heights are counted from there
    thick = max((d for c in protocol.chains.values() for d in c.diameters), default=0.0)
    return thick / 2 / math.cos(math.radians(incline_deg))


def beam_ends(protocol: Protocol, height: float, incline_deg: float) -> tuple[float, float]:
    """Say where a beam meets the board.

    Parameters
    ----------
    protocol
        The scene.
    height
        Of the beam above the contact point, m.
    incline_deg
        Of the board, above 0.

    Returns
    -------
    float, float
        How far uphill of the chain, level, m; how far up along the board's face, from the point
        under the chain, m.
    """
    slope = math.radians(incline_deg)
    rise = height + face_below(protocol, incline_deg)
    return rise / math.tan(slope), rise / math.sin(slope)


def _inclines(protocol: Protocol) -> list[float]:
    return sorted(set(protocol.plan.inclines)) if protocol.surface is not None else []


def _side_view(
    axes: Axes, protocol: Protocol, gates: Gates, top: float, named_above: float = 0.0
) -> None:
    """Draw what is below a height, to scale, and name gates; y, uphill, goes to the right."""
    post = _POST_M if top > 2 * _POST_M else top / 2
    for incline in _inclines(protocol):
        fall = math.tan(math.radians(incline))
        face = -face_below(protocol, incline)
        ends = [(1e3 * y, 1e3 * (face + y * fall)) for y in (-0.5 * post, 1.2 * post)]
        axes.plot(*zip(*ends, strict=True), color=MUTED, linewidth=1.0, zorder=1)
    for y in (-post, post):
        axes.plot([1e3 * y] * 2, [-20, 1e3 * top], color=INK, linewidth=3.0, zorder=2)
    chain = next(iter(protocol.chains.values()))
    for height, width in zip(chain.chain.heights, chain.widths, strict=True):
        z = protocol.drop.value + height
        axes.plot(0, 1e3 * z, "o", color=INK, markersize=max(2.0, 100 * width), zorder=3)
    for gate in gates.gates:
        if gate.height > top:
            continue
        side = -1 if gate.side == "impact" else 1
        axes.plot(
            [-1e3 * post, 1e3 * post], [1e3 * gate.height] * 2, color=_COLOURS[gate.side],
            linewidth=0.9, linestyle="-" if side < 0 else (0, (4, 3)), zorder=2,
        )  # fmt: skip
        if gate.height < named_above:
            continue
        at, look = (1e3 * side * post, 1e3 * gate.height), {"ha": "right" if side < 0 else "left"}
        color = _COLOURS[gate.side]
        annotate(axes, _label(gate), at, (6 * side, 0), va="center", color=color, **look)
    axes.axhline(0, color=INK, linewidth=0.8, linestyle=":")
    axes.plot(0, 0, "x", color=INK, zorder=4)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(-2.2e3 * post, 2.2e3 * post)
    axes.set_ylim(-20, 1e3 * top)
    axes.set_xlabel("mm, uphill to the right" if _inclines(protocol) else "mm")
    axes.set_ylabel(f"mm {protocol.drop_from}" if _inclines(protocol) else "mm")
    axes.grid(visible=False)


def _label(gate: Gate) -> str:
    return f"{gate.channel}: {1e3 * gate.height:g}"


def _name_inclines(axes: Axes, protocol: Protocol, radius: float) -> None:
    for place, incline in enumerate(_inclines(protocol)):
        slope = math.radians(incline)
        face = -face_below(protocol, incline)
        away = radius * (1.0 if place % 2 else 1.45)  # neighbours' names would meet
        at = (1e3 * away * math.cos(slope), 1e3 * (face + away * math.sin(slope)))
        box = {"facecolor": PAPER, "edgecolor": "none", "pad": 0.6}
        axes.text(*at, f"{incline:g}°", color=INK, ha="center", va="center", bbox=box)


def _zero(protocol: Protocol, gates: Gates) -> list[str]:
    """Say where heights are counted from, and how that is carried to both posts."""
    if not _inclines(protocol):
        return [
            "Measure all heights, of the drop and of every beam, from one level, such as the table."
        ]
    posts, marks, agree = "both posts at once", "its post's mark", "marks agree"
    beams = f"Beams: {', '.join(_BEAMS[side] for side in gates.posts)}."
    if len(gates.posts) == 1:
        posts, marks, agree, beams = "the post", "that mark", "mark is right", ""
    zero = (
        "Zero: lay a rod on the board where the lowest rod will strike. Its middle is height 0, "
        f"for the drop and for every beam. Transfer this level to {posts}, with a water hose or a "
        f"spirit level on a straight bar, and mark it. Measure each beam from {marks} to "
        f"± {1e3 * gates.height_u:g} mm (height_uncertainty); the {agree} to "
        f"± {1e3 * gates.datum_u:g} mm (datum_uncertainty)."
    )
    if len(_inclines(protocol)) > 1:
        zero += " To change the incline, turn the board about that rod: 0 stays."
    return [*textwrap.wrap(zero, _WRAP), *filter(None, [beams]), ""]


def _slots(protocol: Protocol, gates: Gates) -> list[str]:
    """Say where each beam of the side that strikes meets the board."""
    inclines = [one for one in _inclines(protocol) if one > 0]
    beams = sorted(gate.height for gate in gates.on("impact"))
    if not inclines or not beams:
        return []
    rows = [["beam, mm", *(f"{one:g}°" for one in inclines)]]
    for height in beams:
        ends = [beam_ends(protocol, height, one) for one in inclines]
        rows.append([f"{1e3 * height:g}", *(f"{1e3 * y:.0f} | {1e3 * s:.0f}" for y, s in ends)])
    return [
        *textwrap.wrap(
            "Each beam crosses the rods front to back and meets the board at: mm uphill of the "
            "rods | mm up along the board. Cut a slot there, a little wider than the beam. Or put "
            "the uphill part closer to the rods than the first number.",
            _WRAP,
        ),
        *text_table(rows),
    ]

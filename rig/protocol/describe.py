"""A scene in words: its parts, gates, assumptions, plan and limits, and what was left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

from rig.boards import BOARDS
from rig.model.chain import XI
from rig.protocol.contact import touching_heights
from rig.protocol.fields import DEFAULTS
from rig.protocol.keys import SECTIONS, range_of
from rig.protocol.measurable import (
    lacking,
    longest_fall,
    most_edges,
    passing_rods,
    record_ms,
    too_long,
    unmeasurable,
)
from rig.protocol.plan import PATTERNS, runs
from rig.protocol.protocol import AT_REST, STANDARD_GRAVITY, Protocol, RodChain
from rig.units import Quantity, format_quantity

_EVEN = 1e-9  # metres by which rounding may change an even spacing


def describe(protocol: Protocol, notes: Sequence[str] = ()) -> str:
    """Describe a protocol in plain text.

    Parameters
    ----------
    protocol
        A checked protocol.
    notes
        What else is known of it, see `rig.predictions.notes`.

    Returns
    -------
    str
        Title and sections ``Scene``, ``Gates``, ``Assumed``, ``Plan and limits`` and
        ``Left out``; empty sections do not appear. Ends without a newline.
    """
    sections = {
        "Scene": [*_scene(protocol)],
        "Gates": [*_gates(protocol)],
        "Assumed (change it if you know better)": [*_priors(protocol)],
        "Plan and limits": [*_plan(protocol), *(f"note: {note}" for note in notes)],
        "Left out": [*_left_out(protocol)],
    }
    blocks = ["\n  ".join([name, *lines]) for name, lines in sections.items() if lines]
    return "\n\n".join([protocol.title, *blocks])


def _number(value: float | Quantity, unit: str) -> str:
    return format_quantity(value if isinstance(value, Quantity) else Quantity(value), unit)


def _scene(protocol: Protocol) -> Iterator[str]:
    """Say what is there."""
    names, surface, track = " and ".join(protocol.chains), protocol.surface, protocol.track
    if track is not None:
        yield f"{names} goes down a track"
    elif surface is None:
        yield f"{names} falls freely"
    elif protocol.two_chains:
        yield f"two chains, {names}: one strikes the surface, the other falls beside it"
    else:
        yield f"one chain, {names}, strikes the surface"
    part, struck = protocol.vocabulary.part, surface is not None
    for chain in protocol.chains.values():
        yield _chain(chain, part, struck=struck)
    if surface is not None and _uses_surface(protocol):
        text = f"surface: restitution {_number(surface.restitution, '1')}"
        text += f", friction {_number(surface.friction, '1')}"
        if surface.pile is not None:
            text += f"; below {_number(surface.pile.below_deg, 'deg')} a pile, restitution "
            text += _number(surface.pile.restitution, "1")
        yield text
    pull, standard = "gravity", STANDARD_GRAVITY
    if track is not None:
        share = track.rolling_inertia
        rolls = f", rolling: I/(m r²) = {share:g}" if share else ""
        yield f"track: {_number(track.incline_deg, 'deg')}{rolls}; heights are along it"
        pull, standard = "acceleration without friction", track.along(STANDARD_GRAVITY)
    usual = protocol.gravity == standard
    note = ", standard gravity: only the start value of the fit" if usual else ""
    yield f"{pull}: {_number(protocol.gravity, 'm/s^2')}{note}"
    if struck or protocol.gates is not None:
        yield f"drop: {_number(protocol.drop, 'mm')} {protocol.drop_from}"
    if protocol.initial_speed != AT_REST:
        yield f"initial speed: {_number(protocol.initial_speed, 'm/s')} downward"
    drag = protocol.drag
    if drag is not None and drag.terminal_speed is not None:
        yield f"drag: terminal speed {_number(drag.terminal_speed, 'm/s')}"
    elif drag is not None and drag.coefficient is not None:
        density = _number(drag.air_density, "kg/m^3")
        yield f"drag: coefficient {_number(drag.coefficient, '1')} in air of {density}"


def _chain(rods: RodChain, part: str, *, struck: bool) -> str:
    """Describe one chain on one line."""
    chain = rods.chain
    text = f"{rods.name}: {chain.rods} {part}s, {_number(chain.length, 'mm')} long"
    if chain.rods == 1:
        text = f"{rods.name}: one {part}"
    thin, thick = min(rods.widths), max(rods.widths)
    if thick > 0:
        word = "wide" if chain.rods > 1 else "long"
        span = f"{thin * 1e3:.1f}" if thin == thick else f"{thin * 1e3:.1f} to {thick * 1e3:.1f}"
        text += f", {span} mm {word} in the beam"
    pitches = [high - low for low, high in pairwise(chain.heights)]
    if pitches and max(pitches) - min(pitches) > _EVEN:
        text += f", {part}s {min(pitches) * 1e3:.1f} to {max(pitches) * 1e3:.1f} mm apart"
    if rods.weighed:
        text += f", {_number(math.fsum(chain.masses), 'g')}"
    if min(chain.masses) != max(chain.masses):
        ratio = max(chain.masses) / min(chain.masses)
        text += f", graded: heaviest {part} {ratio:.3g} times the lightest"
    if chain.alpha is not None:
        text += f", α given as {_number(chain.alpha, '1')}"
    elif struck:
        text += f", inertia {chain.inertia / XI:.3g} m L²"
    return text


def _gates(protocol: Protocol) -> Iterator[str]:
    """List the gates with the rods that pass each."""
    gates, words = protocol.gates, protocol.vocabulary
    if gates is None or not gates.gates:
        return
    totals = {name: rods.chain.rods for name, rods in protocol.chains.items()}
    for gate in gates.gates:
        side = f"{gate.side:6}  " if words.two_sides else ""
        passing = passing_rods(protocol, gate).items()
        rods = ", ".join(f"{name} {totals[name] - n + 1}–{totals[name]}" for name, n in passing)
        parts = "" if protocol.one_object else f"  {words.part}s {rods}"
        yield f"{side}channel {gate.channel:2}  {gate.height * 1e3:8.1f} mm{parts}"
    height, datum = _number(gates.height_u, "mm"), _number(gates.datum_u, "mm")
    sides = " on each side" if words.two_sides else ""
    yield f"each height ± {height}; the zero of the heights ± {datum}{sides}"


SCENES: dict[str, Callable[[Protocol], bool]] = {
    "": lambda _: True,
    "surface": lambda protocol: protocol.surface is not None,
    "two chains": lambda protocol: protocol.two_chains,
    "rods that strike": lambda protocol: protocol.surface is not None and not protocol.one_object,
    "tilted rods": lambda protocol: any(rods.tilt_deg for rods in protocol.chains.values()),
    "no drag": lambda protocol: protocol.drag is None,
}
"""What a scene may need for a key to matter, see `rig.protocol.keys.Key`."""


def _priors(protocol: Protocol) -> Iterator[str]:
    """List what is assumed where nothing was measured, as standard deviations."""
    if protocol.gates is None:
        return
    for name, key in SECTIONS["priors"].items():
        if SCENES[key.scene](protocol):
            value = getattr(protocol.priors, name)
            stated = "" if value == DEFAULTS[key.path] else " (stated)"
            text = _number(value, range_of(key.path).unit)
            yield f"{name:14} {text:>8}{stated}  {key.meaning}"
    if protocol.surface is not None:
        yield from _touching(protocol, _number(protocol.contact.level, "mm"))
        strike = _number(protocol.contact.strike, "mm")
        yield f"the top rod strikes {strike} above it, on the rods below"


def _touching(protocol: Protocol, level: str) -> Iterator[str]:
    """Say at which height rods touch the surface."""
    if not protocol.contact.from_board:
        yield f"contact level: {level} above the zero of the heights"
        return
    for incline in dict.fromkeys(protocol.plan.inclines):
        for name in protocol.strikers:
            heights = touching_heights(protocol.chains[name], incline)
            low, high = (_number(round(z, 4), "mm") for z in (min(heights), max(heights)))
            rod = "a rod" if not protocol.unlike_chains else f"a rod of {name}"
            middle = high if low == high else f"{low} to {high}"
            yield f"at {incline:g}° {rod} touches when its middle is {middle} above the board"
    yield f"further offset of the contact level: {level}"


def _plan(protocol: Protocol) -> Iterator[str]:
    """List runs, edges, recording, boards and time."""
    planned, plan = runs(protocol), protocol.plan
    count = "1 run" if len(planned) == 1 else f"{len(planned)} runs"
    angles = ", ".join(f"{angle:g}" for angle in plan.inclines)
    struck = protocol.surface is not None
    yield f"{count}: {plan.repeats} at each incline ({angles} deg)" if struck else count
    if protocol.two_chains:
        first = next(iter(protocol.chains))
        share = sum(run.impact == first for run in planned)
        yield f"order {plan.order}: chain {first} strikes in {share} of {len(planned)} runs"
        period = len(PATTERNS[plan.order])
        if plan.repeats % period:
            yield f"note: {plan.order} is balanced only if repeats is a multiple of {period}"
    if protocol.gates is None:
        return
    if protocol.blind:
        yield "blind: results stay hidden until rig unblind SESSION"
    yield from (f"note: prediction only: {reason}" for reason in unmeasurable(protocol))
    if (problem := too_long(protocol)) is not None:
        yield f"note: cannot be recorded: {problem}"
    yield f"at most {most_edges(protocol)} edges in a drop"
    seconds = record_ms(protocol) / 1e3
    fall_s = longest_fall(protocol)
    yield f"recording: {seconds:g} s; the last edge comes within {fall_s:.2g} s"
    yield from _boards(protocol)
    total = len(planned) * (plan.settle + seconds)
    time = f"{total:.0f} s" if total < 60 else f"{total / 60:.0f} min"
    yield (
        f"duration: about {time}, with {plan.settle:g} s to settle before each drop; "
        f"{protocol.vocabulary.reset} adds to this"
    )


def _boards(protocol: Protocol) -> Iterator[str]:
    """Name the boards that can run a protocol, and what the other boards lack."""
    wants = {word: lacking(protocol, board) for word, board in BOARDS.items()}
    if able := [word for word, problems in wants.items() if not problems]:
        yield f"suitable boards: {', '.join(able)}"
    for word, problems in wants.items():
        gates = [problem for problem in problems if problem.key.startswith("gates.")]
        for problem in [problem for problem in problems if problem not in gates] + gates[:1]:
            # Of many alike the first will do.
            more = f" (and {len(gates) - 1} more)" if problem in gates and gates[1:] else ""
            yield f"note: board {word} is not suitable: {problem}{more}"


def _uses_surface(protocol: Protocol) -> bool:
    """Whether any impact coefficient follows from the surface."""
    return any(rods.chain.alpha is None for rods in protocol.chains.values())


def _left_out(protocol: Protocol) -> Iterator[str]:
    """List what the scene does not have, and what is therefore not computed."""
    if protocol.surface is None:
        result = "gravity" if protocol.track is None else "the acceleration with its friction"
        yield f"no surface: no impact, Δz or V; the drops measure {result}"
    else:
        if len(protocol.chains) == 1:
            yield "no second chain: no Δz and no release skew"
        if not _uses_surface(protocol):
            yield "α is given: restitution, friction and inclination are not used"
        elif max(protocol.plan.inclines) == 0:
            yield "level surface: no friction, no inclination"
        elif protocol.surface.friction == Quantity(0.0):
            yield "no friction given: taken as 0 at every incline"
    if protocol.gates is None:
        yield "no gates: prediction only, nothing is measured"
    if protocol.drag is None:
        yield "no drag: predictions ignore air; the fit estimates it"

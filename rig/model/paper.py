"""The paper's own scenes, its figures as numbers, and where its text and its equations part."""

from __future__ import annotations

from dataclasses import replace
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

from rig.model.chain import Chain
from rig.model.continuum import UniformChain, end, separation_leading_order, speed
from rig.model.fall import Fall, fall, free_fall, kicks
from rig.model.impact import Impact, alpha_inclined, alpha_level, impact_on
from rig.model.motion import Motion
from rig.model.surface import Pile, Surface
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    Columns = dict[str, list[float]]

LENGTH, DROP, GRAVITY = 1.165, 0.18, 9.81
RODS, PITCH = 25, LENGTH / 24
MIDDLE_INCLINE = 40.0
FRAME_S = 1 / 480
PILE = Pile(30.0, Quantity(-0.37))
SURFACE = Surface(Quantity(0.5, 0.05), Quantity(0.2, 0.02), PILE)
BARE = replace(SURFACE, pile=None)
UNIFORM = Chain((1.0,) * RODS, tuple(LENGTH * k / (RODS - 1) for k in range(RODS)))
FREE_FALL_SPEED = free_fall(UNIFORM, DROP, GRAVITY)[0]
GRADED_DIAMETERS = tuple(d for d in (32e-3, 25e-3, 19e-3, 13e-3, 6.3e-3) for _ in range(4))
MEASURED_GRADED_SEPARATION = 0.17
"""Of the run in Fig. 4, m; read two frames before the impact."""
TEXT_FREE_FALL_SPEED = 5.08
"""m/s, with Fig. 3."""
TEXT_FOUNTAIN_ALPHAS = 0.10, 0.12
"""α of lift-off from how high bead chains leap out of their beakers (section S V)."""


def graded() -> Chain:
    """Chain of Fig. 4: thinner rods towards the top, equal gaps, mass as the square of d."""
    halves = [(lower + upper) / 2 for lower, upper in pairwise(GRADED_DIAMETERS)]
    gap = (LENGTH - sum(halves)) / len(halves)
    heights = (*accumulate((gap + half for half in halves[:-1]), initial=0.0), LENGTH)
    return Chain(tuple((d / GRADED_DIAMETERS[0]) ** 2 for d in GRADED_DIAMETERS), heights)


def graded_motion() -> Motion:
    """The fall of Fig. 4: the graded chain at 40°."""
    chain = graded()
    impact = impact_on(BARE, chain, MIDDLE_INCLINE)
    return Motion(chain, kicks(chain, [impact.alpha] * chain.rods, impact.gamma), DROP, GRAVITY)


def _fall(chain: Chain, impact: Impact) -> Fall:
    return fall(chain, impact.alpha, impact.gamma, DROP, GRAVITY)


def figure_3(step_deg: float = 1.0) -> Columns:
    """Δz and V against inclination, on the surface and, below 30°, on the pile.

    Inclines at which the rod would not slide are left out of the first.
    """
    rows = []
    steps = round(90.0 / step_deg)
    for on_pile, surface in ((0.0, BARE), (1.0, SURFACE)):
        for number in range(steps):
            incline = number * step_deg
            if on_pile and incline > PILE.below_deg:
                continue
            # The rule is strict; the curve is drawn up to the edge.
            impact = impact_on(surface, UNIFORM, min(incline, 29.999) if on_pile else incline)
            if impact.notes:
                continue
            fall_end = _fall(UNIFORM, impact)
            rows.append((incline, on_pile, fall_end.separation_m, fall_end.speed_m_s))
    return _columns(("incline_deg", "pile", "separation_m", "speed_m_s"), rows)


def _columns(names: Sequence[str], rows: Sequence[Sequence[float]]) -> Columns:
    return {name: [row[n] for row in rows] for n, name in enumerate(names)}


def figure_4() -> Columns:
    """Height of the top rod against V² for the graded chain at 40°, striking and free.

    Between impacts both are straight lines, so there are two points an impact: just before, and
    just after.
    """
    motion = graded_motion()
    moments = [(0.0, 0.0)]
    for hit in motion.hits:
        moments += [(hit.time_s, hit.speed_before), (hit.time_s, hit.speed_after)]
    rows = []
    for time, velocity in moments[:-1]:  # the top rod's own impact pulls on nothing
        instant = motion.at(time)
        top = instant.height_m + motion.chain.length
        rows.append((time, top, velocity**2, top + instant.separation_m, (GRAVITY * time) ** 2))
    return _columns(("time_s", "height_m", "speed2", "free_height_m", "free_speed2"), rows)


def figure_6(points: int = 199) -> Columns:
    """Δz and V against rod inertia ξ at 40°: discrete model, Eq. 14 and Eq. 15."""
    names = ("inertia", "separation_m", "speed_m_s", "eq15_separation_m", "eq14_speed_m_s")
    return _columns(names, [_inertia_row(n / (points + 1)) for n in range(1, points + 1)])


def _inertia_row(inertia: float) -> Sequence[float]:
    chain = replace(UNIFORM, inertia=inertia)
    impact = impact_on(BARE, chain, MIDDLE_INCLINE)
    fall_end = _fall(chain, impact)
    smooth = UniformChain(LENGTH, PITCH, impact.alpha, impact.gamma, DROP, GRAVITY)
    eq15 = separation_leading_order(impact.alpha, LENGTH, smooth.reach_m)
    return inertia, fall_end.separation_m, fall_end.speed_m_s, eq15, speed(smooth, 0.0)


def claims() -> dict[int | None, dict[str, str]]:
    """Numbers of the text and what the equations give for them, by the figure they are on.

    Where they part, computed here and now; `None` is for what no figure shows.
    """
    at_80, at_40 = (
        alpha_inclined(0.5, 0.2, incline) / alpha_inclined(0.5, 0.0, incline)
        for incline in (80.0, 40.0)
    )
    _, separation, fast, eq15, eq14 = _inertia_row(UNIFORM.inertia)
    off = [
        100 * abs(leading / exact - 1.0)
        for _, exact, _, leading, _ in map(_inertia_row, (0.05, 0.9, 0.01))
    ]
    motion = graded_motion()
    final = motion.at(motion.end_s).separation_m
    # The last frame is anywhere in the last 1/480 s; the one read is two before it.
    early = motion.at(motion.end_s - 2.0 * FRAME_S).separation_m

    # Δz of a chain far faster than its own fall makes it (S17), over that from rest, γs ≪ z₀.
    larger = [
        100 * end(UniformChain(LENGTH, PITCH, alpha, 0.0, 0.0, 0.0, 1.0)).separation_m
        / end(UniformChain(LENGTH, PITCH, alpha, 0.0, 0.0, GRAVITY)).separation_m - 100
        for alpha in (1e-9, 0.1)
    ]  # fmt: skip
    lifted = alpha_level(0.0)
    low, high = TEXT_FOUNTAIN_ALPHAS
    return {
        3: {
            "friction raises α by 2.25 at 80°": f"{at_80:.3f} (and {at_40:.4f} at 40°, "
            "where the text says about 20 %)",
            f"free-fall speed {TEXT_FREE_FALL_SPEED:.2f} m/s": f"{FREE_FALL_SPEED:.3f} m/s "
            f"from {DROP + LENGTH:.3f} m",
        },
        6: {
            "Eq. 14 within 4 % of the discrete model": f"{abs(eq14 / fast - 1.0) * 100:.1f} % "
            "at ξ = 1/3",
            "Eq. 15 within 4 %": f"{abs(eq15 / separation - 1.0) * 100:.1f} % at ξ = 1/3, "
            "{:.0f} % at 0.05, {:.0f} % at 0.9, {:.0f} % at 0.01".format(*off),
            "Δz only 20 % larger for very large initial speeds (S17)": f"{larger[0]:.0f} % "
            f"as α → 0, {larger[1]:.0f} % at α = 0.1",
        },
        None: {
            f"lift-off (S20) similar to the fountains' α of {low:.2f} to {high:.2f}": (
                f"{lifted:.3f}, {lifted / high:.1f} to {lifted / low:.1f} times that"
            ),
        },
        4: {
            f"graded chain: Δz = {MEASURED_GRADED_SEPARATION * 100:.0f} cm, measured": (
                f"{final * 100:.1f} cm; {early * 100:.1f} cm two frames before the impact"
            ),
        },
    }

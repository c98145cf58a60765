"""The paper's scenes, its figures as numbers, and differences between its text and equations."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate, pairwise, product
from operator import mul

import numpy as np

from rig.model.chain import Chain, equal_gaps
from rig.model.continuum import UniformChain, end, end_speed, separation_leading_order
from rig.model.fall import Fall, Hit, fall, free_leg, hits, kicks
from rig.model.impact import Impact, alpha_inclined, alpha_level, impact_on
from rig.model.surface import Pile, Surface
from rig.text_rows import read_text
from rig.units import Quantity

Columns = dict[str, list[float]]

LENGTH, DROP, GRAVITY = 1.165, 0.18, 9.81
RODS, PITCH = 25, LENGTH / 24
MIDDLE_INCLINE = 40.0
FRAME_S = 1 / 480
PILE = Pile(30.0, Quantity(-0.37))
SURFACE = Surface(Quantity(0.5, 0.05), Quantity(0.2, 0.02), PILE)
BARE = replace(SURFACE, pile=None)
UNIFORM = Chain((1.0,) * RODS, tuple(LENGTH * k / (RODS - 1) for k in range(RODS)))
FREE_FALL_SPEED = free_leg(DROP + LENGTH, 0.0, GRAVITY)[0]
GRADED_DIAMETERS = tuple(d for d in (32e-3, 25e-3, 19e-3, 13e-3, 6.3e-3) for _ in range(4))
MEASURED_GRADED_SEPARATION = 0.17
"""Measured in the run of Fig. 4, m; read two frames before the impact."""
TEXT_FREE_FALL_SPEED = 5.08
"""m/s, with Fig. 3."""
TEXT_FOUNTAIN_ALPHAS = 0.10, 0.12
"""α of lift-off from the height of bead chains leaping out of beakers (section S V)."""


def graded_chain() -> Chain:
    """Return the chain of Fig. 4: thinner rods towards the top, equal gaps, mass ∝ d²."""
    return Chain(tuple(d**2 for d in GRADED_DIAMETERS), equal_gaps(GRADED_DIAMETERS, LENGTH))


def graded_fall() -> tuple[list[Hit], list[float]]:
    """Return the impacts of the fall of Fig. 4, the graded chain at 40°, and Δz at each, m."""
    chain = graded_chain()
    impact = impact_on(BARE, chain, MIDDLE_INCLINE)
    gains = kicks(chain, [impact.alpha] * chain.rods, impact.gamma)
    impacts = hits(chain, gains, DROP, GRAVITY)
    # Between impacts the speed difference of both chains is constant.
    faster = accumulate(hit.speed_after - hit.speed_before for hit in impacts)
    legs = (later.time_s - hit.time_s for hit, later in pairwise(impacts))
    return impacts, [*accumulate(map(mul, faster, legs), initial=0.0)]


def _fall(chain: Chain, impact: Impact) -> Fall:
    return fall(chain, impact.alpha, impact.gamma, DROP, GRAVITY)


def figure_3() -> Columns:
    """Return Δz and V against inclination, on the surface and, below 30°, on the pile.

    For the surface, inclines at which the rod would not slide are left out.
    """
    rows = []
    for on_pile, incline in product((0.0, 1.0), map(float, range(90))):
        # The pile rule excludes 30°; the curve is drawn up to it.
        surface, struck = (SURFACE, min(incline, 29.999)) if on_pile else (BARE, incline)
        impact = impact_on(surface, UNIFORM, struck)
        if impact.notes or (on_pile and incline > PILE.below_deg):
            continue
        fall_end = _fall(UNIFORM, impact)
        rows.append((incline, on_pile, fall_end.separation_m, fall_end.speed_m_s))
    return _columns(("incline_deg", "pile", "separation_m", "speed_m_s"), rows)


def _columns(names: Sequence[str], rows: Sequence[Sequence[float]]) -> Columns:
    return {name: [row[n] for row in rows] for n, name in enumerate(names)}


def figure_4() -> Columns:
    """Return the height of the top rod against V² for the graded chain at 40°, striking and free.

    Between impacts both are straight lines, so two points suffice for each impact: just before and
    just after.
    """
    rows = [(0.0, DROP + LENGTH, 0.0, DROP + LENGTH, 0.0)]
    for hit, separation, place in zip(*graded_fall(), graded_chain().heights, strict=True):
        top, free_speed = LENGTH - place, GRAVITY * hit.time_s
        rows += [
            (hit.time_s, top, velocity**2, top + separation, free_speed**2)
            for velocity in (hit.speed_before, hit.speed_after)
        ]
    rows.pop()  # the top rod's impact changes no speed
    return _columns(("time_s", "height_m", "speed2", "free_height_m", "free_speed2"), rows)


def figure_6() -> Columns:
    """Return Δz and V against rod inertia ξ at 40°: discrete model, Eq. 14 and Eq. 15."""
    names = ("inertia", "separation_m", "speed_m_s", "eq15_separation_m", "eq14_speed_m_s")
    return _columns(names, [_inertia_row(n / 200) for n in range(1, 200)])


def _inertia_row(inertia: float) -> Sequence[float]:
    chain = replace(UNIFORM, inertia=inertia)
    impact = impact_on(BARE, chain, MIDDLE_INCLINE)
    fall_end = _fall(chain, impact)
    smooth = UniformChain(LENGTH, PITCH, impact.alpha, impact.gamma, DROP, GRAVITY)
    eq15 = separation_leading_order(impact.alpha, LENGTH, smooth.reach_m)
    return inertia, fall_end.separation_m, fall_end.speed_m_s, eq15, end_speed(smooth)


def claims() -> dict[int | None, dict[str, str]]:
    """Return numbers of the text that differ from the equations' results, by their figure.

    Results are computed here; the key is `None` for claims without a figure. The sentences are in
    ``paper.txt``, a line for each claim after the number of its figure.
    """
    raised = [
        alpha_inclined(0.5, 0.2, incline) / alpha_inclined(0.5, 0.0, incline)
        for incline in (80.0, 40.0)
    ]
    rows = [_inertia_row(inertia) for inertia in (UNIFORM.inertia, 0.05, 0.9, 0.01)]
    _, _, fast, _, eq14 = rows[0]
    impacts, separations = graded_fall()
    # The last frame is within 1/480 s before the impact; the frame read is two before that.
    read_s = impacts[-1].time_s - 2.0 * FRAME_S
    early = float(np.interp(read_s, [hit.time_s for hit in impacts], separations))
    # Δz of a chain far faster than its own fall makes it (S17), over that from rest, γs ≪ z₀.
    ratios = [
        end(UniformChain(LENGTH, PITCH, alpha, 0.0, 0.0, 0.0, 1.0)).separation_m
        / end(UniformChain(LENGTH, PITCH, alpha, 0.0, 0.0, GRAVITY)).separation_m
        for alpha in (1e-9, 0.1)
    ]
    lifted = alpha_level(0.0)
    values = {
        "friction": raised,
        "text_speed": TEXT_FREE_FALL_SPEED,
        "free_fall_speed": FREE_FALL_SPEED,
        "start": DROP + LENGTH,
        "eq14": 100 * abs(eq14 / fast - 1.0),
        "eq15": [100 * abs(leading / exact - 1.0) for _, exact, _, leading, _ in rows],
        "larger": [100 * ratio - 100 for ratio in ratios],
        "fountains": TEXT_FOUNTAIN_ALPHAS,
        "lifted": lifted,
        "above": [lifted / alpha for alpha in TEXT_FOUNTAIN_ALPHAS],
        "graded": [100 * z for z in (MEASURED_GRADED_SEPARATION, separations[-1], early)],
    }
    by_figure: dict[int | None, dict[str, str]] = {}
    for line in read_text(__file__).splitlines():
        number, claim, equations = line.format_map(values).split(" | ")
        figure = int(number) if number.isdigit() else None
        by_figure.setdefault(figure, {})[claim] = equations
    return by_figure

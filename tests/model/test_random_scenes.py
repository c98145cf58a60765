"""Whole scenes at random, as text, against the equations with 50 digits."""

from __future__ import annotations

import math
from itertools import accumulate
from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.predictions import predictions
from rig.protocol.reader import parse
from tests.examples import examples
from tests.model.air_reference import reference_air_fall
from tests.model.chains import close, decades
from tests.model.reference import printed_alpha, reference_fall

DIGITS = 50
# Twenty legs of a dozen roundings, and as many again in α.
TIGHT = 1e-13


class Scene(NamedTuple):
    """Numbers as a protocol has them: kg, m, degrees, m/s, m/s²."""

    masses: list[float]
    gaps: list[float]
    restitution: float
    friction: float
    beyond: float
    inertia: float
    drop: float
    speed: float
    gravity: float

    @property
    def incline(self) -> float:
        """Steep enough for the rods to slide."""
        sliding = math.degrees(math.atan(self.friction))
        return sliding + self.beyond * (85.0 - sliding)

    @property
    def heights(self) -> list[float]:
        return list(accumulate(self.gaps, initial=0.0))

    def text(self, more: str = "") -> str:
        masses = ", ".join(f"{m!r} kg" for m in self.masses)
        gaps = ", ".join(f"{gap!r} m" for gap in self.gaps)
        return f"""\
protocol: 1
chains:
  A:
    rods: {len(self.masses)}
    masses: [{masses}]
    spacing: [{gaps}]
    inertia: {self.inertia / 4.0!r}
surface: {{restitution: {self.restitution!r}, friction: {self.friction!r}}}
drop: {self.drop!r} m
initial_speed: {self.speed!r} m/s
gravity: {self.gravity!r} m/s^2
plan: {{incline: {self.incline!r} deg}}
{more}"""

    def coefficients(self) -> tuple[mp.mpf, mp.mpf]:
        """α by Eqs. 12 and 13 and γ by Eq. 10, as printed."""
        with mp.workdps(DIGITS):
            xi = mp.mpf(self.inertia)
            alpha = printed_alpha(self.restitution, self.friction, self.incline, self.inertia)
            return alpha, (1 + xi) * (1 + 1 / xi) / 4


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    rods = draw(st.integers(2, 20))
    return Scene(
        draw(st.lists(decades(-4, 1), min_size=rods, max_size=rods)),
        draw(st.lists(decades(-3, 0), min_size=rods - 1, max_size=rods - 1)),
        draw(st.floats(-0.9, 1.0)),
        draw(st.floats(0.0, 2.0)),
        draw(st.floats(0.05, 1.0)),
        draw(st.floats(0.05, 0.95)),
        draw(decades(-3, 1)),
        draw(st.one_of(st.just(0.0), decades(-2, 2))),
        draw(decades(-2, 2)),
    )


def check(text: str, wanted: tuple[mp.mpf, ...], relative: float) -> None:
    (line,) = predictions(parse(text))
    for key, value in zip(("separation_m", "speed_m_s", "fall_time_s"), wanted, strict=True):
        assert close(getattr(line, key), value, relative), key


@examples(100)
@given(scenes())
def test_a_scene_is_predicted_to_the_last_digits(scene):
    alpha, gamma = scene.coefficients()
    wanted = reference_fall(
        scene.masses, scene.heights, alpha, gamma, scene.drop, scene.gravity, scene.speed,
        digits=DIGITS,
    )  # fmt: skip
    check(scene.text(), wanted, TIGHT)


@examples(100)
@given(scenes(), decades(0, 3))
def test_a_scene_in_air_too(scene, terminal):
    alpha, gamma = scene.coefficients()
    with mp.workdps(DIGITS):
        kappa = mp.mpf(scene.gravity) / mp.mpf(terminal) ** 2
        drags = [kappa * m for m in scene.masses]
    wanted = reference_air_fall(
        scene.masses, scene.heights, alpha, gamma, drags, scene.drop, scene.gravity, scene.speed
    )
    # In much air what was gained dies away as e^(−2κ × way), with that number's relative error.
    many = TIGHT * (1.0 + float(kappa) * (scene.drop + scene.heights[-1]))
    check(scene.text(f"drag: {{terminal_speed: {terminal!r} m/s}}\n"), wanted, many)

"""Scenes from the simplest to the richest, each with something that the one before lacks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Scene:
    """A protocol to be measured.

    Attributes
    ----------
    name
        Short, for tables.
    text
        The protocol.
    """

    name: str
    text: str


_LEVEL = "surface: {restitution: 0.50}\n"
_INCLINED = "surface: {restitution: 0.50, friction: 0.20}\n"
_UNSURE = "surface: {restitution: 0.50 ± 0.05, friction: 0.20 ± 0.02}\n"
_DROP, _UNSURE_DROP = "drop: 180 mm\n", "drop: 180 mm ± 2 mm\n"
_PLAN = "plan: {incline: 40 deg}\n"
_PLANS = "plan: {incline: [30 deg, 40 deg, 50 deg, 60 deg, 70 deg, 80 deg], randomize: incline}\n"
_GATES = """\
gates:
  impact: [{channel: 0, height: 22 mm}, {channel: 1, height: 34 mm}]
  free: [{channel: 8, height: 20 mm}, {channel: 9, height: 60 mm}]
release: {channel: 0, pulse: 80 ms}
accept: {release_skew: 5 ms, missed_edges: 5 %}
"""


def ladder() -> list[Scene]:
    """The paper's chain, from free fall to the whole experiment."""
    two = "  B: {like: A}\n"
    air = "drag: {terminal_speed: 25 m/s}\n"
    return [
        Scene("free fall", _scene()),
        Scene("α given, level", _scene("surface: {}\n", _DROP, keys=", alpha: 0.25, gamma: 1")),
        Scene("level surface", _scene(_LEVEL, _DROP)),
        Scene("inclined", _scene(_INCLINED, _DROP, _PLAN)),
        Scene("± on β, μ, drop", _scene(_UNSURE, _UNSURE_DROP, _PLAN)),
        Scene("second chain", _scene(two, _UNSURE, _UNSURE_DROP, _PLAN)),
        Scene("six inclines", _scene(two, _UNSURE, _UNSURE_DROP, _PLANS)),
        Scene("gates", _scene(two, _UNSURE, _UNSURE_DROP, _PLANS, _GATES)),
        Scene("drag, no gates", _scene(two, _UNSURE, _UNSURE_DROP, _PLANS, air)),
    ]


def _scene(*parts: str, keys: str = "") -> str:
    return f"""\
protocol: 1
title: measured
gravity: 9.81 m/s^2
chains:
  A: {{rods: 25, length: 1165 mm, diameter: 12.7 mm, tilt: 12 deg{keys}}}
{"".join(parts)}"""

"""Layouts of gates and kinds of chains on which identification must hold, as protocol files."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from rig.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Scene = Literal["two", "single", "fence"]

ACCEPT = {"release_skew": "50 ms", "missed_edges": "5 %"}
"""Wide for the skew, so that doubled disturbances do not void drops that are read well."""
INCLINES = ("0 deg", "20 deg", "40 deg", "60 deg")
REPEATS = 4
_FREE_CHANNEL = 8


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of chain, and how it hangs.

    Attributes
    ----------
    name
        In words.
    chain
        As a protocol's ``chains`` describe one.
    drop_mm
        From the bottom rod's middle to the contact point.
    scene
        Two chains, one that strikes, or one that falls freely.
    other
        The second chain, where it is not like the first.
    """

    name: str
    chain: Mapping[str, Any]
    drop_mm: float = 180.0
    scene: Scene = "two"
    other: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class GateLayout:
    """Gates of one scene: heights above the contact point, mm."""

    kind: Kind
    impact: tuple[float, ...]
    free: tuple[float, ...]

    @property
    def gates(self) -> str:
        """How many gates each side has, such as ``3 + 3``."""
        return " + ".join(str(len(side)) for side in (self.impact, self.free) if side)

    @property
    def heights(self) -> str:
        """The gates' heights as people write them, mm."""
        sides = (", ".join(f"{mm:g}" for mm in side) for side in (self.impact, self.free) if side)
        return " + ".join(sides)

    def protocol(self) -> str:
        """Text of a protocol file with this scene."""
        sides = {"impact": (self.impact, 0), "free": (self.free, _FREE_CHANNEL)}
        gates: dict[str, Any] = {
            side: [{"channel": first + n, "height": f"{mm:g} mm"} for n, mm in enumerate(heights)]
            for side, (heights, first) in sides.items()
            if heights
        }
        plan: dict[str, Any] = {"repeats": REPEATS}
        scene: dict[str, Any] = {"protocol": 1, "chains": {"A": dict(self.kind.chain)}}
        accept = dict(ACCEPT)
        if self.kind.scene == "two":
            scene["chains"]["B"] = dict(self.kind.other or {"like": "A"})
            plan["order"] = "ABBA"
        else:
            del accept["release_skew"]
        if self.kind.scene != "fence":
            plan["incline"] = [*INCLINES]
            pile = {"below": "30 deg", "restitution": -0.37}
            scene["surface"] = {
                "restitution": "0.50 ± 0.05", "friction": "0.20 ± 0.02", "pile": pile,
            }  # fmt: skip
        scene |= {
            "drop": f"{self.kind.drop_mm:g} mm ± {self.kind.drop_mm / 90:.2g} mm",
            "gravity": "9.81 m/s^2",
            "gates": gates | {"height_uncertainty": "0.3 mm"},
            "release": {"channel": 0, "pulse": "80 ms"},
            "plan": plan,
            "accept": accept,
        }
        # JSON is YAML.
        return json.dumps(scene, ensure_ascii=False, indent=1)


def even(rods: int, length_mm: float, diameter_mm: float, tilt_deg: float = 12.0) -> dict[str, Any]:
    """Rods all alike at equal distances."""
    return {
        "rods": rods,
        "length": f"{length_mm:g} mm",
        "diameter": f"{diameter_mm:g} mm",
        "tilt": f"{tilt_deg:g} deg",
    }


def graded(diameters_mm: Sequence[float], length_mm: float) -> dict[str, Any]:
    """Groups of four rods of each diameter from the bottom up, with equal gaps between them."""
    groups = [{"count": 4, "diameter": f"{one:g} mm"} for one in diameters_mm]
    length = f"{length_mm:g} mm"
    return {"rods": groups, "spacing": "equal-gaps", "length": length, "tilt": "12 deg"}


def uneven(gaps_mm: Sequence[float], diameter_mm: float) -> dict[str, Any]:
    """Rods at listed distances."""
    return {
        "rods": len(gaps_mm) + 1,
        "diameter": f"{diameter_mm:g} mm",
        "spacing": [f"{gap:g} mm" for gap in gaps_mm],
    }


STANDARD = Kind("25 rods", even(25, 1165, 12.7))
KINDS = (
    Kind("2 rods", even(2, 100, 12.7)),
    Kind("3 rods", even(3, 120, 12.7)),
    Kind("10 rods", even(10, 450, 12.7)),
    Kind("60 rods", even(60, 2900, 12.7)),
    Kind("100 rods", even(100, 2970, 8)),
    Kind("thin at the top", graded((32, 25, 19, 13, 6.3), 1165)),
    Kind("thin at the bottom", graded((6.3, 13, 19, 25, 32), 1165)),
    Kind("uneven", uneven((31, 52, 40, 66, 35, 48, 72, 39, 57, 44, 61), 12.7)),
    Kind("tiny", even(8, 70, 2), drop_mm=25),
    Kind("tall", even(25, 4800, 40), drop_mm=600),
)
SINGLE = Kind("25 rods, one chain", STANDARD.chain, scene="single")
FENCE = Kind(
    "fence of 8 bars",
    {"rods": 8, "length": "350 mm", "diameter": "25 mm"},
    drop_mm=400,
    scene="fence",
)

_GATES: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...] = (
    ((25,), (20,)),
    ((25,), (20, 80)),
    ((25, 70), (20,)),
    ((25,), (20, 80, 150)),
    ((25, 70), (20, 80)),
    ((30, 130), (60, 140)),
    ((204, 301), (204, 301)),
    ((22, 70, 350), (20, 100, 350)),
    ((22, 34, 70, 130), (20, 60, 100, 140)),
    ((22, 34, 70, 204, 350), (20, 60, 140, 204, 350)),
    ((22, 34, 70, 130, 204, 350), (20, 60, 100, 140, 204, 350)),
    ((22, 34, 70, 130, 204, 350, 690, 1078), (20, 60, 100, 140, 204, 350, 690, 1078)),
)
"""For the standard chain; README's few gates and the eight beside eight of the paper's scene."""
SHARES: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...] = (
    ((0.2,), (0.18,)),
    ((0.2, 0.65), (0.18, 0.6)),
    ((0.2, 0.3, 0.45, 0.7), (0.18, 0.35, 0.55, 0.75)),
)
"""For the other chains: heights as shares of the drop, so that all rods pass all gates."""


def under(kind: Kind, impact: Sequence[float], free: Sequence[float]) -> GateLayout:
    """Put gates below the hanging chain, at shares of its drop."""
    sides = [tuple(round(share * kind.drop_mm, 2) for share in shares) for shares in (impact, free)]
    return GateLayout(
        kind, () if kind.scene == "fence" else sides[0], () if kind.scene == "single" else sides[1]
    )


LAYOUTS = (
    *(GateLayout(STANDARD, impact, free) for impact, free in _GATES),
    *(under(kind, *shares) for kind in (*KINDS, SINGLE, FENCE) for shares in SHARES),
)
"""All that the bench tries."""


def chosen(layouts: Sequence[GateLayout], text: str | None) -> list[GateLayout]:
    """Layouts with a text in their names; all if there is none.

    Raises
    ------
    InputError
        No layout is called like that.
    """
    names = [f"{one.kind.name}: {one.gates}" for one in layouts]
    found = [one for one, name in zip(layouts, names, strict=True) if (text or "") in name]
    if not found:
        known = ", ".join(dict.fromkeys(names))
        raise InputError(f"no layout has {text!r} in its name", f"there are {known}")
    return found

"""Scenes at the ends of what can be asked: each quantity by itself, and every two together."""

import math
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from itertools import combinations, product
from typing import NamedTuple

from rig.bench.references import Number, Values, exact_coefficients, exact_fall, many_digits
from rig.bench.work import Answer, end_values
from rig.model import paper
from rig.model.chain import UNIFORM_ROD_INERTIA, Chain
from rig.model.drag import drag_fall
from rig.model.fall import fall, kicks
from rig.model.impact import gamma_finite, impact_on
from rig.model.surface import Surface
from rig.text_rows import read_rows
from rig.units import Quantity

PAPER: dict[str, float] = {
    "restitution": paper.BARE.restitution.value, "friction": paper.BARE.friction.value,
    "incline": paper.MIDDLE_INCLINE, "inertia": UNIFORM_ROD_INERTIA,
    "length": paper.LENGTH, "drop": paper.DROP, "gravity": paper.GRAVITY,
}  # fmt: skip


class Extreme(NamedTuple):
    """One scene.

    Attributes
    ----------
    name
        What is driven to its end, and how far.
    inputs
        Numbers of the scene whose rounding counts: all but masses, heights and drags.
    masses
        Bottom up.
    even_air
        Whether the air holds all legs back alike; else κ grows by a third to the top.
    """

    name: str
    inputs: Mapping[str, float] = PAPER
    masses: tuple[float, ...] = paper.UNIFORM.masses
    even_air: bool = True

    @property
    def chain(self) -> Chain:
        """The chain, with α where it is given."""
        inputs, last = self.inputs, len(self.masses) - 1
        heights = tuple(inputs["length"] * k / last for k in range(last + 1))
        alpha = Quantity(inputs["alpha"]) if "alpha" in inputs else None
        further = inputs.get("inertia_z"), alpha, inputs.get("gamma")
        return Chain(self.masses, heights, inputs["inertia"], *further)

    @property
    def kappas(self) -> list[float]:
        """κ of each leg, 1/m; empty without air."""
        kappa, rods = self.inputs.get("kappa", 0.0), len(self.masses)
        growth = 0.0 if self.even_air else kappa / (3.0 * rods)
        return [kappa + growth * k for k in range(rods)] if kappa else []

    def predict(self) -> Answer:
        """Return what the model says of each quantity, and its notes on the domain."""
        inputs, chain = self.inputs, self.chain
        surface = Surface(Quantity(inputs["restitution"]), Quantity(inputs["friction"]))
        impact = impact_on(surface, chain, inputs["incline"])
        where = inputs["drop"], inputs["gravity"], inputs.get("speed", 0.0)
        if kappas := self.kappas:
            gains = kicks(chain, [impact.alpha] * chain.rods, impact.gamma)
            end = drag_fall(chain, gains, kappas, *where)
        else:
            end = fall(chain, impact.alpha, impact.gamma, *where)
        values = {"alpha": impact.alpha, "gamma": impact.gamma, **end_values(end)}
        return Answer(values, chain.rods, "; ".join(impact.notes))

    def as_printed(self) -> Answer:
        """Return what the equations as printed give with the digits and the range of a float."""
        values = self.exact(self.inputs, as_float=True)
        return Answer({name: float(value) for name, value in values.items()}, len(self.masses))

    def exact(self, inputs: Mapping[str, Number], *, as_float: bool = False) -> Values:
        """Return the true values of inputs near to these, or those of the equations as printed."""
        coefficients = exact_coefficients(inputs, as_float=as_float)
        coefficients |= {name: Decimal(inputs[name]) for name in coefficients if name in inputs}
        with many_digits():  # heights and drags are what floats make of them, but for the nudge
            heights, kappas = (
                [Decimal(inputs[name]) / Decimal(self.inputs[name]) * Decimal(x) for x in floats]
                for name, floats in (("length", self.chain.heights), ("kappa", self.kappas))
            )
        alphas, gammas = ([coefficients[name]] * len(heights) for name in ("alpha", "gamma"))
        where = inputs["drop"], inputs["gravity"], inputs.get("speed", 0.0)
        return coefficients | exact_fall(
            self.masses, heights, alphas, gammas, *where, kappas, as_float=as_float
        )


_ENDS = {
    quantity: [[*map(float, ends.split())] for ends in columns]
    for quantity, *columns in read_rows(__file__)
}
ALONE = {quantity: alone for quantity, (alone, _) in _ENDS.items()}
TOGETHER = {quantity: together for quantity, (_, together) in _ENDS.items() if together}
"""Ends of each quantity, by themselves and by twos."""
_APART = ({"alpha", "incline"}, {"alpha", "friction"}, {"air", "unequal air"})
"""Pairs of which the one leaves the other out."""


def alone() -> Iterator[Extreme]:
    """Yield every end of every quantity by itself, and the paper's scene."""
    yield Extreme("as in the paper")
    yield from (_scene({quantity: end}) for quantity, ends in ALONE.items() for end in ends)
    yield Extreme("mass 1e-300, top rod only", masses=(*paper.UNIFORM.masses[1:], 1e-300))


def pairs() -> Iterator[Extreme]:
    """Yield every two ends of two quantities."""
    for quantities in combinations(TOGETHER, 2):
        if {*quantities} not in _APART:
            for ends in product(*map(TOGETHER.__getitem__, quantities)):
                yield _scene(dict(zip(quantities, ends, strict=True)))


def _scene(ends: Mapping[str, float]) -> Extreme:
    """Drive quantities of the paper's scene to ends."""
    further = dict(ends)
    rods, decades = int(further.pop("rods", paper.RODS)), further.pop("mass decades", 0.0)
    # Both ends inside the floats' own 616 decades.
    middle = 0.5 * decades if abs(decades) > 300 else 0.0
    inputs = dict(PAPER)
    for quantity, end in further.items():
        inputs |= _INPUTS[quantity](end) if quantity in _INPUTS else {quantity: end}
    return Extreme(
        " + ".join(f"{quantity} {end:.11g}" for quantity, end in ends.items()),
        inputs,
        tuple(10.0 ** (decades * k / (rods - 1) - middle) for k in range(rods)),
        "unequal air" not in ends,
    )


def _near_pole(distance: float) -> dict[str, float]:
    cos, sin = math.cos(math.radians(10.0)), math.sin(math.radians(10.0))
    free_rod = gamma_finite(PAPER["inertia"])
    singular = (cos**2 + free_rod * sin**2) / ((free_rod - 1.0) * sin * cos)
    return {"incline": 10.0, "friction": singular * (1.0 - distance)}


_INPUTS: dict[str, Callable[[float], dict[str, float]]] = {
    "alpha": lambda alpha: {"alpha": alpha, "gamma": 4.0 / 3.0},
    "pole": _near_pole,
    "length": lambda length: {"length": length, "drop": length / 8},
    "air": lambda kappa: {"kappa": kappa},
    "unequal air": lambda kappa: {"kappa": kappa},
}
"""Inputs that a quantity changes, where they are not that quantity alone."""

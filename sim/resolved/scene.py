"""What falls and onto what: plain numbers in SI units and radians.

x runs along the level lines of the board and so along the rods, y down its slope, z upwards; the
rods' middles hang on x = y = 0. A rod's tilt is in the x-z plane, an incline in the y-z plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    Numbers = NDArray[Any]  # of floats

FORCE_AT_BREAK = 578.0
"""N: the paper's line is sold as 130 lb (58.9 kg) test, S I."""


@dataclass(frozen=True, slots=True)
class Rods:
    """A chain's rods, bottom up.

    Attributes
    ----------
    masses, heights, diameters
        kg; of each middle above the nominal bottom middle, m; m.
    tilts, yaws
        Against the horizontal, with their sign, and about the vertical, rad.
    aside
        Of each middle down the slope, m.
    length
        Of every rod, m.
    rolling
        Whether a rod may turn about its own axis; Eqs. S7 to S10 leave that out.
    inertia
        Moment of inertia of a rod about its middle in units of m L², its thickness left out.
    """

    masses: Numbers
    heights: Numbers
    diameters: Numbers
    tilts: Numbers
    yaws: Numbers
    aside: Numbers
    length: float
    rolling: bool = True
    inertia: float = 1.0 / 12.0

    @property
    def end_mass(self) -> float:
        """What an end of a rod weighs when it is struck, over the rod's mass: ¼ of a thin one."""
        return 1.0 / (1.0 + 1.0 / (4.0 * self.inertia))


@dataclass(frozen=True, slots=True)
class Bounce:
    """One kind of contact.

    Attributes
    ----------
    restitution
        Speed after over speed before, of the points that touch. At least 0.1.
    time_s
        How long one rod's end stays in touch if it bounces by itself; gives the stiffness.
    friction
        Coulomb's coefficient.
    """

    restitution: float
    time_s: float
    friction: float


@dataclass(frozen=True, slots=True)
class Board:
    """A plane that touches an undisturbed rod just when its middle is at height 0."""

    incline: float
    bounce: Bounce


@dataclass(frozen=True, slots=True)
class Strings:
    """Strings between the ends of neighbours; they pull and do not push.

    Attributes
    ----------
    restitution
        Speed with which they part after a jerk over the speed with which it came; at least 0.1.
    strain_at_break
        Relative extension under `FORCE_AT_BREAK`; gives the stiffness.
    """

    restitution: float = 0.3
    strain_at_break: float = 0.05

    @property
    def stiffness(self) -> float:
        """Force per relative extension, N."""
        return FORCE_AT_BREAK / self.strain_at_break


@dataclass(frozen=True, slots=True)
class Chain:
    """One chain as it is let go.

    Attributes
    ----------
    rods, strings
        What it is made of.
    start
        Height of the nominal bottom rod's middle above the contact level, m.
    gravity
        m/s².
    board
        `None` falls freely.
    touching
        How rods bounce on rods; `None` lets them pass through each other.
    drag
        Per rod: the air takes drag·v² from its acceleration, 1/m.
    swing
        Velocity down the slope of each rod as it is let go, m/s; `None` hangs still.
    spin
        Turning about the vertical as it is let go, rad/s.
    held
        How many rods, from the first on, are not let go.
    """

    rods: Rods
    strings: Strings
    start: float
    gravity: float
    board: Board | None = None
    touching: Bounce | None = None
    drag: Numbers | None = None
    swing: Numbers | None = None
    spin: float = 0.0
    held: int = 0


@dataclass(slots=True)
class Fall:
    """What became of one chain.

    Attributes
    ----------
    times
        Of the samples, s after release, equally spaced; shape (T,).
    heights, sideways, slopes
        Of each rod's middle, z and x in m, and its slope dz/dx; shape (T, N).
    frames_s, places, axes
        For pictures: now and then all middles and axes; shapes (F,), (F, 3, N), (F, 3, N).
    touched_s
        First touch of each rod, with the board or with a rod that touched before, s; infinite if
        none.
    touched_height
        Of its middle then, m.
    top_speed
        Downward speed of the top rod's middle just before its first touch, m/s.
    pulled
        For each rod the downward impulse on the chain above it, from its own first touch until
        the next rod's, N s: J of Eq. 9 as it happens.
    board_impulse
        Of the board on all rods, N s; shape (3,).
    lost
        Energy lost where, J: ``board``, ``board friction``, ``rods``, ``strings``, ``air``.
    energy
        Of everything, kinetic, potential and elastic, J, at each frame.
    momentum
        Of all rods less what the board gave them, N s, at each frame; shape (F, 3).
    """

    times: Numbers
    heights: Numbers
    sideways: Numbers
    slopes: Numbers
    frames_s: Numbers
    places: Numbers
    axes: Numbers
    touched_s: Numbers
    touched_height: Numbers
    top_speed: float
    pulled: Numbers
    board_impulse: Numbers
    lost: dict[str, float]
    energy: Numbers
    momentum: Numbers

    @property
    def strike_s(self) -> float:
        """When the top rod strikes."""
        return float(self.touched_s[-1])

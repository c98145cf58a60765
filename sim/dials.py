"""Every disturbance of the simulated rig, as one named dial."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from rig.errors import InputError
from rig.units import DIMENSIONS

from .dial import dial, read_value
from .resolved.contact_law import DEADEST

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Self

    from rig.protocol.protocol import Protocol

_TIME, _LENGTH = DIMENSIONS["TIME"], DIMENSIONS["LENGTH"]
_OF_THE_URL = ("dynamics", "pace", "seed", "series", "truth")  # no disturbances
_SWITCH = dial(0.0, switch=True)
_SLOWEST = -0.5  # of a clock, relative; a real one is off by less than 0.5 %


@dataclass(frozen=True, slots=True)
class Dials:
    """Sizes of all disturbances; every ``_sd`` is a standard deviation.

    Those of `Dials.stated` may be not-a-number, which takes what the protocol says of the same.

    Attributes
    ----------
    skew_sd
        Scatter of the free chain's release time about the impact chain's, s.
    delay, delay_sd
        From the fire stamp to the impact chain's release, s.
    hang_sd
        Scatter of each hanging height from run to run, m.
    side_sd
        How much lower one side hangs than the other, in every run, m.
    drop_error
        How far the drop is off its stated value, in its own standard uncertainties; one draw a
        session, this is its standard deviation.
    impact_error
        How far restitution and friction, or a stated α, are off their stated values, likewise.
    rod_sd
        Rods off their nominal places on the string, m; the same in every run of that chain.
    width_sd
        Effective rod width off its nominal value, m; one draw a chain.
    gate_sd
        Beam heights off their stated values, m; the same in every run.
    datum_sd
        Zero of each post off the contact point, m: all gates of a side share it in every run.
    beam_sd
        Beams off the rods' middle, m: shifts edges by x·tan(tilt), up and down rod by rod.
    contact_sd
        How far above the contact level rods touch that the last one does not count among, m; one
        draw an incline. Of the model's world, as the next one is: resolved rods touch as they do.
    strike_sd
        How far above that the last one strikes, on what lies there, m.
    impulse_sd
        Relative scatter of single impulses about Eq. 9.
    jitter_sd
        Scatter of each edge in time, s.
    missed
        Share of edges that leave no trace.
    chatter
        Share of edges at which the comparator flickers.
    string
        Chance for each gap between rods that the string flickers in the beam.
    bounce
        Chance for each struck rod to bounce back through the lowest beam.
    clock
        Error of the device's clock, relative.
    drift
        By how much that changes in an hour, relative.
    wander
        Standard deviation of its random walk after an hour, relative.
    reference
        Error of a wired 1 Hz reference, relative; not-a-number: none is wired.
    latency
        Mean of the exponential delay of the host's reads, s.
    stalled, stall
        Share of the host's reads that are held up, and for how long, s.
    corrupt, lose
        Share of bytes on the line, either way, that are changed or lost.
    drag
        The air takes drag·v² from the acceleration of the first chain, 1/m, beyond what the
        protocol states; of other rods, and of what still falls, as width over mass goes.
    restitution, friction
        True coefficients; not-a-number takes the protocol's.
    """

    skew_sd: float = dial(2e-3, _TIME)
    delay: float = dial(20e-3, _TIME, kept=True)
    delay_sd: float = dial(1e-3, _TIME)
    hang_sd: float = dial(0.1e-3, _LENGTH, stated="priors.hang", guessed=True)
    side_sd: float = dial(0.0, _LENGTH, stated="priors.side", guessed=True)
    drop_error: float = dial(0.5)
    impact_error: float = dial(0.0)
    rod_sd: float = dial(0.3e-3, _LENGTH, stated="")
    width_sd: float = dial(0.1e-3, _LENGTH, stated="")
    gate_sd: float = dial(0.2e-3, _LENGTH, stated="gates.height_u")
    datum_sd: float = dial(0.2e-3, _LENGTH, stated="gates.datum_u")
    beam_sd: float = dial(0.5e-3, _LENGTH, stated="priors.beam_offset", guessed=True)
    contact_sd: float = dial(0.0, _LENGTH, stated="contact.level.u", guessed=True)
    strike_sd: float = dial(0.0, _LENGTH, stated="contact.strike.u", guessed=True)
    impulse_sd: float = dial(0.02)
    jitter_sd: float = dial(2e-6, _TIME, stated="priors.jitter")
    missed: float = dial(0.01, high=1.0)
    chatter: float = dial(0.005, high=1.0)
    string: float = dial(0.002, high=1.0)
    bounce: float = dial(0.05, high=1.0)
    clock: float = dial(-1300e-6, low=_SLOWEST)
    drift: float = dial(0.0, low=-math.inf)
    wander: float = dial(0.0)
    reference: float = dial(math.nan, low=_SLOWEST, kept=True)
    latency: float = dial(0.3e-3, _TIME)
    stalled: float = dial(0.0, high=1.0)
    stall: float = dial(50e-3, _TIME, kept=True)
    corrupt: float = dial(0.0, high=1.0)
    lose: float = dial(0.0, high=1.0)
    drag: float = dial(0.0)
    restitution: float = dial(math.nan, low=-1.0, high=1.0, kept=True)
    friction: float = dial(math.nan, kept=True)

    @classmethod
    def quiet(cls) -> Self:
        """All disturbances off: the model itself, on a perfect rig."""
        return cls(**{spec.name: 0.0 for spec in fields(cls) if not spec.metadata.get("kept")})

    @classmethod
    def stated(cls) -> Self:
        """A rig that is off by as much as its protocol says, wherever it says it."""
        sizes = {spec.name: math.nan for spec in fields(cls) if "stated" in spec.metadata}
        return cls(**sizes, drop_error=1.0, impact_error=1.0)

    def on(self, protocol: Protocol, share: Callable[[str], float] = lambda _: 1.0) -> Self:
        """Take what is not-a-number from a protocol, but for what differs from chain to chain.

        Parameters
        ----------
        share
            How large each size really is of what is stated where nobody has measured it.
        """
        sizes: dict[str, float] = {}
        for spec in fields(self):
            path = spec.metadata.get("stated")
            if path and math.isnan(getattr(self, spec.name)):
                u: Any = protocol
                for name in path.split("."):
                    u = getattr(u, name, 0.0)  # without gates nothing is stated of them
                guessed = spec.metadata.get("guessed")
                sizes[spec.name] = u * (share(spec.name.removesuffix("_sd")) if guessed else 1.0)
        return replace(self, **sizes)


@dataclass(frozen=True, slots=True)
class ResolvedDials(Dials):
    """Dials of the resolved world, ``dynamics=resolved``: its materials, and how chains hang in it.

    Where no source is named the default is a guess, chosen so that touches last the 0.1 to 0.3 ms
    that hard things of this size take.

    Attributes
    ----------
    string_restitution
        With what share of its speed a string's jerk throws rods back; a guess. 0.1 is as dead as
        can be, 0.7 lively.
    string_strain
        Relative extension at the 578 N that the paper's line is sold for; makers of braided
        polyethylene state 3 to 5 %, and knots give more.
    board_time, rod_time
        How long a rod's end stays in touch with the board, or with another rod; guesses.
    rod_restitution, rod_friction
        Of rods on rods; guesses, wood being known on the paper's laminate only (0.5 and 0.2).
    rods_touch
        0 lets rods pass through each other, as in the model.
    density
        Of rods that were not weighed, kg/m³: poplar at 12 % moisture, 0.42 to 0.45.
    roll
        0 keeps rods from turning about their own axis, as Eqs. S7 to S10 do.
    tilt_sd, yaw_sd
        Scatter of each rod's tilt, the same in every run, and of its direction in each hanging,
        degrees; guesses.
    aside_sd
        Scatter of each rod's place down the slope in each hanging, m; a guess.
    off_centre_sd
        Scatter of a chain's place along the beams' posts from drop to drop, m; a guess.
    swing_sd
        Speed of the bottom rod down the slope as it is let go, the top rod being at rest, m/s; a
        guess: a swing of 3 mm.
    spin_sd
        Turning of the chain about the vertical, rad/s.
    """

    string_restitution: float = dial(0.3, low=DEADEST, high=1.0, kept=True)
    string_strain: float = dial(0.05, low=1e-4, high=1.0, kept=True)
    board_time: float = dial(0.2e-3, _TIME, 1e-5, 2e-3, kept=True)
    rod_time: float = dial(0.2e-3, _TIME, 1e-5, 2e-3, kept=True)
    rod_restitution: float = dial(0.5, low=DEADEST, high=1.0, kept=True)
    rod_friction: float = dial(0.3, high=10.0, kept=True)
    rods_touch: float = dial(1.0, kept=True, switch=True)
    density: float = dial(450.0, DIMENSIONS["DENSITY"], 1.0, 25e3, kept=True)
    roll: float = dial(1.0, kept=True, switch=True)
    tilt_sd: float = dial(1.0, DIMENSIONS["ANGLE"], high=45.0)
    yaw_sd: float = dial(2.0, DIMENSIONS["ANGLE"], high=45.0)
    aside_sd: float = dial(0.5e-3, _LENGTH, high=0.1)
    off_centre_sd: float = dial(1e-3, _LENGTH, high=1.0)
    swing_sd: float = dial(10e-3, DIMENSIONS["SPEED"], high=10.0)
    spin_sd: float = dial(0.0, DIMENSIONS["TURNING"], high=100.0)


def or_stated(dial: float, stated: float) -> float:
    """Return a dial, or what is stated where it is not-a-number."""
    return stated if math.isnan(dial) else dial


def read_dials(settings: Mapping[str, str], scheme: str = "sim") -> Dials:
    """Dials from a URL's query, for example ``skew_sd=2ms&clock=-1300 ppm``.

    ``dynamics=resolved`` asks for `ResolvedDials`; ``quiet=1`` starts from `Dials.quiet` instead of
    the defaults, ``stated=1`` from `Dials.stated`; `scheme` is the URL's.

    Raises
    ------
    InputError
        An unknown world or dial, or a value that is not a quantity of its dimension or out of
        range.
    """
    rest = dict(settings)
    dynamics = rest.pop("dynamics", "model")
    if dynamics not in {"model", "resolved"}:
        raise InputError(
            f"{scheme}://: dynamics: {dynamics!r} is not known", "model or resolved is accepted"
        )
    kind = ResolvedDials if dynamics == "resolved" else Dials
    begins = {"quiet": kind.quiet, "stated": kind.stated}
    chosen = [
        name for name in begins if read_value(_SWITCH, rest.pop(name, "0"), f"{scheme}://: {name}")
    ]
    if len(chosen) > 1:
        raise InputError(f"{scheme}://: quiet and stated are two rigs", "set one of them")
    dials = begins[chosen[0]]() if chosen else kind()
    specs = {spec.name: spec for spec in fields(kind)}
    resolved = [spec.name for spec in fields(ResolvedDials)]
    values: dict[str, float] = {}
    for name, text in rest.items():
        if name in specs:
            values[name] = read_value(specs[name], text, f"{scheme}://: {name}")
        elif name in resolved:
            raise InputError(
                f"{scheme}://: {name} is a dial of the resolved world", "add dynamics=resolved"
            )
        else:
            accepted = (*begins, *_OF_THE_URL, *specs)
            close = get_close_matches(name, (*accepted, *resolved), 1)
            raise InputError(
                f"{scheme}://: unknown dial {name!r}",
                f"did you mean {close[0]!r}?" if close else f"dials are {', '.join(accepted)}",
            )
    return replace(dials, **values)

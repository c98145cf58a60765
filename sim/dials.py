"""Every disturbance of the simulated rig, as one named dial."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.units import Dimension

from .dial import dial, read_values, silent_values
from .resolved_dials import NAMES as RESOLVED

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.protocol.protocol import Protocol

_TIME, _LENGTH = Dimension.TIME, Dimension.LENGTH
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
    hang_sd: float = dial(0.1e-3, _LENGTH, stated=True)
    side_sd: float = dial(0.0, _LENGTH, stated=True)
    drop_error: float = dial(0.5)
    impact_error: float = dial(0.0)
    rod_sd: float = dial(0.3e-3, _LENGTH, stated=True)
    width_sd: float = dial(0.1e-3, _LENGTH, stated=True)
    gate_sd: float = dial(0.2e-3, _LENGTH, stated=True)
    datum_sd: float = dial(0.2e-3, _LENGTH, stated=True)
    beam_sd: float = dial(0.5e-3, _LENGTH, stated=True)
    contact_sd: float = dial(0.0, _LENGTH, stated=True)
    strike_sd: float = dial(0.0, _LENGTH, stated=True)
    impulse_sd: float = dial(0.02)
    jitter_sd: float = dial(2e-6, _TIME, stated=True)
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
    def quiet(cls) -> Dials:
        """All disturbances off: the model itself, on a perfect rig."""
        return cls(**silent_values(cls))

    @classmethod
    def stated(cls) -> Dials:
        """A rig that is off by as much as its protocol says, wherever it says it."""
        sizes = {spec.name: math.nan for spec in fields(cls) if spec.metadata.get("stated")}
        return cls(**sizes, drop_error=1.0, impact_error=1.0)

    def on(self, protocol: Protocol, share: Callable[[str], float] = lambda _: 1.0) -> Dials:
        """Take what is not-a-number from a protocol, but for what differs from chain to chain.

        Parameters
        ----------
        share
            How large each size really is of what is stated where nobody has measured it.
        """
        gates, priors, contact = protocol.gates, protocol.priors, protocol.contact
        sizes = {
            "hang_sd": priors.hang * share("hang"),
            "side_sd": priors.side * share("side"),
            "gate_sd": gates.height_u if gates else 0.0,
            "datum_sd": gates.datum_u if gates else 0.0,
            "beam_sd": priors.beam_offset * share("beam"),
            "contact_sd": contact.level.u * share("contact"),
            "strike_sd": contact.strike.u * share("strike"),
            "jitter_sd": priors.jitter,
        }
        return replace(
            self, **{name: or_stated(getattr(self, name), u) for name, u in sizes.items()}
        )


_NAMES = tuple(field.name for field in fields(Dials))
_OF_THE_URL = ("dynamics", "pace", "seed", "series", "truth")  # no disturbances, read by the scene


def or_stated(dial: float, stated: float) -> float:
    """Return a dial, or what is stated where it is not-a-number."""
    return stated if math.isnan(dial) else dial


def read_dials(settings: Mapping[str, str], scheme: str = "sim") -> Dials:
    """Dials from a URL's query, for example ``skew_sd=2ms&clock=-1300 ppm``.

    ``quiet=1`` starts from `Dials.quiet` instead of the defaults, ``stated=1`` from `Dials.stated`;
    `scheme` is the URL's.

    Raises
    ------
    InputError
        An unknown dial, or a value that is not a quantity of its dimension or out of range.
    """
    rest = dict(settings)
    begins = {"quiet": Dials.quiet, "stated": Dials.stated}
    chosen = []
    for name in begins:
        text = rest.pop(name, "0")
        if text not in {"0", "1"}:
            raise InputError(f"{scheme}://: {name}: {text!r} is neither 0 nor 1")
        chosen += [name] if text == "1" else []
    if len(chosen) > 1:
        raise InputError(f"{scheme}://: quiet and stated are two rigs", "set one of them")
    dials = begins[chosen[0]]() if chosen else Dials()
    for name in rest:
        if name in RESOLVED:
            raise InputError(
                f"{scheme}://: {name} is a dial of the resolved world", "add dynamics=resolved"
            )
        if name not in _NAMES:
            accepted = (*begins, *_OF_THE_URL, *_NAMES)
            close = get_close_matches(name, (*accepted, *RESOLVED), 1)
            raise InputError(
                f"{scheme}://: unknown dial {name!r}",
                f"did you mean {close[0]!r}?" if close else f"dials are {', '.join(accepted)}",
            )
    return replace(dials, **read_values(Dials, rest, scheme))

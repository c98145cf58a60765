"""The scene behind a simulated port, as its URL describes it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.link.messages import pack_label
from rig.protocol import reader

from .dials import read_dials
from .lab import ChainLab
from .truth import append_truth

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.protocol.protocol import Protocol

    from .dials import Dials
    from .serial_port import SimulatedSerial
    from .truth import Truth

    Hang = Callable[[Protocol, Dials, int, Callable[[Truth], None]], ChainLab]


@dataclass(frozen=True, slots=True)
class Scene:
    """The chains, and how everything around them is disturbed.

    Attributes
    ----------
    pace
        Real seconds a virtual second takes.
    """

    lab: ChainLab
    dials: Dials
    seed: int
    pace: int

    def get_ready(self) -> None:
        """Make all planned drops now, for a board that answers in real time."""
        self.lab.make_ahead([pack_label(number, 1) for number in sorted(self.lab.runs)])

    def disturb(self, port: SimulatedSerial) -> None:
        """Make a port's line as bad as the dials say."""
        dials = self.dials
        port.disturb(
            self.seed, jitter_s=dials.latency, stalled=dials.stalled, stall_s=dials.stall,
            corrupt=dials.corrupt, lose=dials.lose,
        )  # fmt: skip

    def second_ns(self) -> int | None:
        """Length of the wired reference's second; `None` where none is wired."""
        error = self.dials.reference
        return None if math.isnan(error) else round(1e9 / (1.0 + error))


def set_scene(scheme: str, settings: Mapping[str, str]) -> Scene:
    """Hang the chains.

    Parameters
    ----------
    scheme
        Of the URL, for messages.
    settings
        ``protocol``, and perhaps ``seed``, ``series``, ``truth``, ``pace`` and dials.

    Raises
    ------
    InputError
        No protocol, a bad one, or a setting that makes no sense.
    """
    rest = dict(settings)
    source = rest.pop("protocol", "")
    if not source:
        raise InputError(
            f"{scheme}:// needs a scene to simulate", f"name one: {scheme}://?protocol=FILE.yaml"
        )
    seed = _number(scheme, "seed", rest.pop("seed", "0"))
    pace = _number(scheme, "pace", rest.pop("pace", "0"))
    series = _number(scheme, "series", rest.pop("series", "0"))
    truth = rest.pop("truth", "")
    hang, rest = choose_world(rest, scheme)
    dials = read_dials(rest, scheme)
    if truth:
        _check_writable(scheme, Path(truth))

    def tell(fact: Truth) -> None:
        if truth:
            append_truth(Path(truth), fact)

    lab = hang(reader.read(source), dials, seed, tell)
    lab.filmed, lab.series = bool(truth), series
    return Scene(lab, dials, seed, pace)


def choose_world(settings: Mapping[str, str], scheme: str = "sim") -> tuple[Hang, dict[str, str]]:
    """Find out behind which mechanics chains fall, and what is left for `read_dials`.

    Returns
    -------
    hang
        Makes the lab from protocol, dials, seed, and whom to tell the truth.
    rest
        Settings that are no dial of this world.

    Raises
    ------
    InputError
        A world that is none, or a dial of the resolved one out of range.
    """
    rest = dict(settings)
    dynamics = rest.pop("dynamics", "model")
    if dynamics == "model":
        return ChainLab, rest
    if dynamics != "resolved":
        raise InputError(
            f"{scheme}://: dynamics: {dynamics!r} is not known", "model or resolved is accepted"
        )
    from .resolved_dials import NAMES, read_resolved_dials  # noqa: PLC0415 - few ask for it
    from .resolved_lab import ResolvedLab  # noqa: PLC0415

    world = read_resolved_dials(rest, scheme)
    others = {name: text for name, text in rest.items() if name not in NAMES}
    return partial(ResolvedLab, world=world), others


def _check_writable(scheme: str, path: Path) -> None:
    """Find out now: in the middle of a drop the fault would look like a broken cable."""
    try:
        path.open("a", encoding="utf-8").close()
    except OSError as error:
        raise InputError(f"{scheme}://: truth: cannot write {path}: {error.strerror}") from None


def _number(scheme: str, name: str, text: str) -> int:
    if not text.isdecimal():
        raise InputError(f"{scheme}://: {name}: {text!r} is not a whole number from 0 on")
    return int(text)

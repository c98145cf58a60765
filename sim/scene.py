"""The scene behind a simulated port, as its URL describes it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.protocol import reader

from .dials import ResolvedDials, read_dials
from .lab import ChainLab
from .truth import append_truth

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.protocol.protocol import Protocol

    from .dials import Dials
    from .truth import Truth


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
    source, truth = settings.get("protocol"), settings.get("truth")
    if not source:
        raise InputError(
            f"{scheme}:// needs a scene to simulate", f"name one: {scheme}://?protocol=FILE.yaml"
        )
    dials, seed, pace, series = read_disturbances(scheme, settings)
    path = Path(truth) if truth else None
    lab = hang_chains(reader.read(source), dials, seed, partial(append_truth, path))
    if path is not None:
        _check_writable(scheme, path)  # which makes the file, so not for settings that are refused
    for each in (lab, *lab.others.values()):
        each.series = series
    return Scene(lab, dials, seed, pace)


def read_disturbances(scheme: str, settings: Mapping[str, str]) -> tuple[Dials, int, int, int]:
    """Return dials, seed, pace and series; arguments and errors as for `set_scene`."""
    rest = {name: text for name, text in settings.items() if name not in {"protocol", "truth"}}
    numbers = ("seed", "pace", "series")
    seed, pace, series = (_number(scheme, name, rest.pop(name, "0")) for name in numbers)
    return read_dials(rest, scheme), seed, pace, series


def hang_chains(
    protocol: Protocol, dials: Dials, seed: int, tell: Callable[[Truth], None]
) -> ChainLab:
    """Hang a protocol's chains in the world whose dials these are."""
    if not isinstance(dials, ResolvedDials):
        return ChainLab(protocol, dials, seed, tell)
    from .resolved_lab import ResolvedLab  # noqa: PLC0415 - few ask for it

    return ResolvedLab(protocol, dials, seed, tell)


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

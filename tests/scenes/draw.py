"""Odd but valid scenes, each drawn from its seed: what people may well write into a protocol."""

import math
import random
from dataclasses import dataclass
from itertools import pairwise

from rig.protocol.protocol import Protocol
from rig.protocol.reader import parse
from tests.tables import read_table

CHOICES = read_table(__file__, "choices")


@dataclass(frozen=True)
class Scene:
    """One protocol and the simulated rig that it meets.

    Attributes
    ----------
    text
        The protocol file.
    port
        URL of the simulated rig.
    protocol
        What the text says.
    """

    seed: int
    text: str
    port: str
    protocol: Protocol


def scene(seed: int, drops: int = 4) -> Scene:
    """Draw a scene; the same seed gives the same scene on every machine.

    Parameters
    ----------
    drops
        Planned at most; a void one may fall three times. Four are enough to learn from.
    """
    chance = random.Random(f"scene {seed}")
    kind = chance.choices(("fence", "single", "two", "predicted"), (3, 4, 6, 1))[0]
    if kind == "fence" and seed % 3 == 0:  # and nothing else is drawn of other scenes
        kind = "object"
    text = _scene(chance, kind, drops)
    if kind != "predicted":
        text = _with_gates(chance, text)
    return Scene(seed, text, chance.choice(CHOICES["ports"]), parse(text, f"scene-{seed}.yaml"))


def _scene(chance: random.Random, kind: str, drops: int) -> str:
    """Everything but the gates."""
    title = chance.choice(CHOICES["titles"])
    lines = ["protocol: 1", *([f'title: "{title}"'] if title else [])]
    rods = chance.choices((2, 3, 4, 5, 8, 12, 25, 40, 60), (8, 8, 8, 8, 8, 8, 6, 1, 1))[0]
    two = kind == "two" or (kind == "predicted" and chance.random() < 0.5)
    struck = kind not in {"fence", "object"}
    given = struck and chance.random() < 0.2
    if kind == "object":
        lines += ["chains:", f"  ball: {{rods: 1, diameter: {chance.choice((5, 12, 25))} mm}}"]
        lines += chance.choice(([], ["track: {incline: 12 deg ± 0.2 deg, rolling_inertia: 0.4}"]))
    else:
        lines += ["chains:", *_chains(chance, rods, two=two, given=given)]
    if struck:
        bare = given and chance.random() < 0.5
        lines.append(f"surface: {'{}' if bare else chance.choice(CHOICES['surfaces'])}")
    drop = chance.choice((30, 60, 180, 400, 900))
    lines.append(f"drop: {drop} mm{chance.choice(('', f' ± {drop / 100} mm'))}")
    lines.append(chance.choice(CHOICES["gravities"]))
    if kind == "predicted":
        lines.append(chance.choice(("initial_speed: 1.5 m/s", "drag: {terminal_speed: 25 m/s}")))
    lines.append(f"plan: {{{', '.join(_plan(chance, kind, drops, two=two))}}}")
    loose = "{release_skew: 50 ms, missed_edges: 60 %}"
    lines.append(f"accept: {chance.choice(('{missed_edges: 20 %}', loose))}")
    if chance.random() < 0.3:
        lines.append(f"release: {{channel: 0, pulse: {chance.choice((20, 80, 200))} ms}}")
    return "\n".join(lines) + "\n"


def _chains(chance: random.Random, rods: int, *, two: bool, given: bool) -> list[str]:
    """One chain, or two that are alike or not."""
    first, second = chance.choice(CHOICES["names"])
    pitch = chance.choice((8, 15, 30, 49, 90)) if rods < 25 else chance.choice((8, 20, 49))
    about, graded = _rods(chance, rods, pitch)
    if given:
        about += f", alpha: {chance.choice(('0.12', '0.2 ± 0.02', '0'))}"
    lines = [f"  {first}: {{{about}}}"]
    if two:
        keys = [f"like: {first}", *_unlike(chance, rods, pitch, given=given, graded=graded)]
        lines.append(f"  {second}: {{{', '.join(keys)}}}")
    return lines


def _rods(chance: random.Random, rods: int, pitch: float) -> tuple[str, bool]:
    """The rods of a chain, and whether they are graded."""
    thick = round(pitch * chance.choice((0.2, 0.3, 0.5)), 2)
    if rods >= 4 and chance.random() < 0.3:
        sizes = [round(thick * share, 2) for share in (1.0, 0.7, 0.5)]
        if chance.random() < 0.5:
            sizes.reverse()
        counts = (rods // 3, rods // 3, rods - 2 * (rods // 3))
        groups = (f"{{count: {n}, diameter: {d} mm}}" for n, d in zip(counts, sizes, strict=True))
        about = f"rods: [{', '.join(groups)}]{chance.choice(('', ', spacing: equal-gaps'))}"
        graded = True
    else:
        about, graded = f"rods: {rods}, diameter: {thick} mm", False
    about += f", length: {pitch * (rods - 1)} mm"
    if not graded and chance.random() < 0.6:
        tilt = chance.choice((5, 12, 21))
        longest = 0.6 * pitch / math.sin(math.radians(tilt))
        about += f", rod_length: {round(longest, 1)} mm, tilt: {tilt} deg"
    if chance.random() < 0.2:
        about += ", position_uncertainty: 0.1 mm"
    return about, graded


def _unlike(
    chance: random.Random, rods: int, pitch: float, *, given: bool, graded: bool
) -> list[str]:
    """Keys by which the second chain differs from the first."""
    if chance.random() < (0.5 if given else 0.1):
        return ["alpha: 0.25"]
    if chance.random() < 0.3 and rods > 2 and not graded:
        return [f"rods: {rods - 1}, length: {pitch * (rods - 2)} mm"]
    return []


def _plan(chance: random.Random, kind: str, drops: int, *, two: bool) -> list[str]:
    """The plan's keys."""
    inclines = "" if kind in {"fence", "object"} else chance.choice(CHOICES["inclines"])
    found = [f"incline: {inclines}"] if inclines else []
    repeats = [n for n in (1, 2, 3, 4, 6, 8) if n * (inclines.count(",") + 1) <= drops]
    found.append(f"repeats: {chance.choice(repeats)}")
    if two:
        found.append(f"order: {chance.choice(('ABBA', 'ABBA', 'alternate', 'fixed'))}")
    if chance.random() < 0.3:
        found.append(f"randomize: {chance.choice(('none', 'incline', 'all'))}")
        found.append(f"seed: {chance.randrange(2**63)}")
    return [*found, "settle: 1 s"]


def _with_gates(chance: random.Random, text: str) -> str:
    """Add beams at clear heights, few or many, on the sides that the scene has."""
    protocol = parse(text)
    free = protocol.two_chains or protocol.surface is None
    sides = [side for side, there in (("impact", protocol.surface), ("free", free)) if there]
    channels = iter(range(16))
    lines = []
    for side in sides:
        most = 8 if len(sides) == 2 else chance.choice((8, 16))
        heights = _clear(protocol)
        number = min(len(heights), chance.choice((2, 3, 5, most)))
        # V shows in the last centimetres only: most people put beams there, some do not.
        low = heights[: min(2, number)] if chance.random() < 0.7 else []
        rest = [height for height in heights if height not in low]
        chosen = sorted([*low, *chance.sample(rest, number - len(low))])
        beams = (f"{{channel: {next(channels)}, height: {height} mm}}" for height in chosen)
        lines.append(f"  {side}: [{', '.join(beams)}]")
    if chance.random() < 0.5:
        lines.append(f"  height_uncertainty: {chance.choice(('0', '0.3', '1'))} mm")
    return text + "\n".join(["gates:", *lines]) + "\n"


def _clear(protocol: Protocol) -> list[float]:
    """Heights (mm) where no rod of any chain hangs, nor lies: some below all, some between."""
    spans = sorted(
        (drop + height - half, drop + height + half)
        for rods in protocol.chains.values()
        for height, width in zip(rods.chain.heights, rods.widths, strict=True)
        for drop, half in ((protocol.drop.value, width / 2 + max(1.1e-3, protocol.drop.u)),)
    )
    widest = max(width for rods in protocol.chains.values() for width in rods.widths)
    floor, below = max(widest / 2, 1e-3) + 2e-4, spans[0][0]
    found = [floor + (below - floor) * share for share in (0.02, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8)]
    top = min(protocol.drop.value + rods.chain.length for rods in protocol.chains.values())
    reach = 0.0
    for (_, low), (high, _) in pairwise(spans):
        reach = max(reach, low)
        if high - reach > 4e-4 and (reach + high) / 2 < top:
            found.append((reach + high) / 2)
    return sorted({round(height * 1e3, 1) for height in found if height > floor})

"""Description of a scene in words: parts, gates, assumptions, plan and limits, and omissions.

The words are in ``describe.txt``; this module computes the facts that they need.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise, product
from string import Formatter
from typing import Any

from rig.boards import BOARDS
from rig.model.chain import XI
from rig.protocol import measurable
from rig.protocol.contact import touching_heights
from rig.protocol.fields import DEFAULTS
from rig.protocol.keys import SECTIONS, range_of
from rig.protocol.plan import PATTERNS, runs
from rig.protocol.protocol import STANDARD_GRAVITY, Protocol, RodChain
from rig.text_rows import read_paragraphs
from rig.units import UNITS, Quantity, format_quantity

_EVEN = 1e-9  # m, tolerance for an even spacing
_SECTIONS = {heading: rows for heading, *rows in read_paragraphs(__file__)}
_STATED = [name for name in vars(Protocol) if not name.startswith("_")]
Facts = Mapping[str, Any]


def describe(protocol: Protocol, notes: Sequence[str] = ()) -> str:
    """Describe a protocol in plain text.

    Parameters
    ----------
    protocol
        A checked protocol.
    notes
        Further remarks, see `rig.predictions.notes`.

    Returns
    -------
    str
        Title and sections ``Scene``, ``Gates``, ``Assumed``, ``Plan and limits`` and
        ``Left out``; empty sections do not appear. Ends without a newline.
    """
    facts = _list_facts(protocol)
    sections = {name: _write(name, facts) for name in _SECTIONS if not name.startswith("-")}
    sections["Plan and limits"] += [f"note: {note}" for note in notes]
    blocks = ["\n  ".join([name, *lines]) for name, lines in sections.items() if lines]
    return "\n\n".join([protocol.title, *blocks])


class _Words(Formatter):
    """Formatter that writes a quantity in the unit after its colon."""

    def format_field(self, value: Any, format_spec: str) -> Any:
        if format_spec not in UNITS:
            return super().format_field(value, format_spec)
        quantity = value if isinstance(value, Quantity) else Quantity(value)
        return format_quantity(quantity, format_spec)


_WORDS = _Words()


def _holds(words: str, facts: Facts) -> bool:
    """Whether all named facts hold, and none that is marked by ``!``."""
    values = ((word, _WORDS.get_field(word.lstrip("!"), (), facts)[0]) for word in words.split())
    return all(bool(value) != word.startswith("!") for word, value in values)


def _write(section: str, facts: Facts, parts: Iterable[Facts] = ({},)) -> list[str]:
    """Return the lines of a section whose facts hold, once or once for each part."""
    text = ""
    for part in parts:
        all_facts = {**facts, **part}
        for when, _, words in (row.partition("|") for row in _SECTIONS[section]):
            if _holds(when, all_facts):
                text += "\n" + _WORDS.vformat(words.strip(), (), all_facts)
    return text.replace("\n…", "").split("\n")[1:]


def _list_facts(protocol: Protocol) -> dict[str, Any]:
    """Return stated and derived facts of a protocol, by their names in ``describe.txt``."""
    surface, track, plan = protocol.surface, protocol.track, protocol.plan
    gates, chains, planned = protocol.gates, protocol.chains.values(), runs(protocol)
    first, period = next(iter(protocol.chains)), len(PATTERNS[plan.order])
    standard = STANDARD_GRAVITY if track is None else track.along(STANDARD_GRAVITY)
    recording = measurable.record_ms(protocol) / 1e3
    total = len(planned) * (plan.settle + recording)
    wants = {word: measurable.lacking(protocol, board) for word, board in BOARDS.items() if gates}
    facts = {name: getattr(protocol, name) for name in _STATED} | {
        "names": " and ".join(protocol.chains),
        "uses_surface": surface and any(rods.chain.alpha is None for rods in chains),
        "smooth": surface and surface.friction == Quantity(0.0),
        "level": max(plan.inclines) == 0,
        "tilted": any(rods.tilt_deg for rods in chains),
        "standard": protocol.gravity == standard,
        "runs": len(planned),
        "several": len(planned) > 1,
        "settings": "; ".join(protocol.variants),
        "angles": ", ".join(f"{angle:g}" for angle in plan.inclines),
        "first": first,
        "share": sum(run.impact == first for run in planned),
        "period": period,
        "unbalanced": plan.repeats % period,
        "too_long": gates and measurable.too_long(protocol),
        "edges": measurable.most_edges(protocol),
        "recording": recording,
        "fall": measurable.longest_fall(protocol),
        "duration": f"{total:.0f} s" if total < 60 else f"{total / 60:.0f} min",
        "boards": ", ".join(word for word, problems in wants.items() if not problems),
    }
    parts = {
        "chain": map(_chain_facts, chains),
        "gate": _gate_facts(protocol),
        "prior": _prior_facts(protocol, facts),
        "touch": _touch_facts(protocol),
        "lack": (
            {"board": board, "lack": problems[0], "more": len(problems) - 1}
            for board, problems in wants.items()
            if problems
        ),
    }
    return facts | {
        f"each_{part}": "\n".join(_write(f"- {part}", facts, each)) for part, each in parts.items()
    }


def _chain_facts(rods: RodChain) -> Facts:
    chain, thin, thick = rods.chain, min(rods.widths), max(rods.widths)
    pitches = [high - low for low, high in pairwise(chain.heights)] or [0.0]
    least, most = min(chain.masses), max(chain.masses)
    return {
        "chain": rods,
        "thin": thin * 1e3,
        "thick": thick * 1e3,
        "unlike": thin != thick,
        "closest": min(pitches) * 1e3,
        "farthest": max(pitches) * 1e3,
        "uneven": max(pitches) - min(pitches) > _EVEN,
        "mass": math.fsum(chain.masses),
        "graded": least != most and most / least,
        "inertia": chain.inertia / XI,
    }


def _gate_facts(protocol: Protocol) -> Iterator[Facts]:
    for gate in protocol.gates.gates:
        passing = measurable.passing_rods(protocol, gate)
        totals = ((name, protocol.chains[name].chain.rods, n) for name, n in passing.items())
        rods = ", ".join(f"{name} {total - n + 1}–{total}" for name, total, n in totals)
        yield {"gate": gate, "height": gate.height * 1e3, "passing": rods}


def _prior_facts(protocol: Protocol, scene: Facts) -> Iterator[Facts]:
    """Yield the assumed standard deviations of quantities that are not measured."""
    for name, key in SECTIONS["priors"].items():
        if _holds(key.scene, scene):
            value = getattr(protocol.priors, name)
            text = format_quantity(Quantity(value), range_of(key.path).unit)
            stated = value != DEFAULTS[key.path]
            yield {"name": name, "value": text, "stated": stated, "meaning": key.meaning}


def _touch_facts(protocol: Protocol) -> Iterator[Facts]:
    """Yield the contact heights of rods on the board, for each incline and chain."""
    inclines = dict.fromkeys(protocol.plan.inclines if protocol.contact.from_board else ())
    for incline, name in product(inclines, protocol.strikers):
        heights = [round(z, 4) for z in touching_heights(protocol.chains[name], incline)]
        low, high = min(heights), max(heights)
        yield {"incline": incline, "name": name, "low": low, "high": high, "unlike": low != high}

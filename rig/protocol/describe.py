"""Description of a scene in words: parts, gates, assumptions, plan and limits, and omissions.

The words are in the template ``describe.txt``.
"""

import re
from collections.abc import Iterator, Sequence

from jinja2 import Environment, StrictUndefined

from rig.boards import BOARDS
from rig.model.chain import XI
from rig.model.surface import NO_FRICTION
from rig.protocol import measurable
from rig.protocol.contact import touching_heights
from rig.protocol.fields import DEFAULTS
from rig.protocol.keys import SECTIONS, range_of
from rig.protocol.protocol import PATTERNS, STANDARD_GRAVITY, Protocol
from rig.text_rows import read_text
from rig.units import Quantity, format_quantity


def _write(value: Quantity | float, unit: str) -> str:
    return format_quantity(value if isinstance(value, Quantity) else Quantity(value), unit)


_TEMPLATES = Environment(undefined=StrictUndefined)  # noqa: S701 - plain text, for a terminal
_TEMPLATES.filters["quantity"] = _write
_TEMPLATES.globals |= {
    "measurable": measurable,
    "touching_heights": touching_heights,
    "PATTERNS": PATTERNS,
    "STANDARD_GRAVITY": STANDARD_GRAVITY,
    "NO_FRICTION": NO_FRICTION,
    "XI": XI,
}
_DESCRIPTION = _TEMPLATES.from_string(read_text(__file__))


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
    boards = BOARDS.items() if protocol.gates else ()
    text = _DESCRIPTION.render(
        protocol=protocol,
        lacking={word: measurable.lacking(protocol, board) for word, board in boards},
        assumed=_assumed(protocol),
        notes=notes,
    )
    lines = "\n".join(line for line in text.split("\n") if line.strip()).replace("\n…", "")
    sections = re.split(r"\n(?=\S)", lines)
    return "\n\n".join([protocol.title, *(section for section in sections if "\n" in section)])


def _assumed(protocol: Protocol) -> Iterator[tuple[str, str, bool, str]]:
    """Yield the assumed standard deviations of quantities that are not measured."""
    tilted = any(rods.tilt_deg for rods in protocol.chains.values())
    for name, key in SECTIONS["priors"].items():
        matters = _TEMPLATES.compile_expression(key.scene or "true")
        if matters(protocol=protocol, tilted=tilted):
            value = getattr(protocol.priors, name)
            text = format_quantity(Quantity(value), range_of(key.path).unit)
            yield name, text, value != DEFAULTS[key.path], key.meaning

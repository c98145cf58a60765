"""What to do about a reason for a void drop: one table, which every face reads."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_COMPARE = (
    "hold what hangs there against rig check PROTOCOL: chain, drop, incline, gates' heights and "
    "channels"
)
_REMEDIES: tuple[tuple[str, str], ...] = (
    ("^damaged: ", "rig recover SESSION says what is whole, and with -o NEW saves it"),
    ("likeliest, but not clearly", _COMPARE),  # names several things, of which one may be true
    ("in the wrong way round", "exchange the two plugs, or their channels in the protocol"),
    ("pile up", "incline the surface more, or hang fewer rods"),
    ("see every rod", "let the chains hang still before they go, or put the lowest gate higher"),
    ("upside down", "turn the chain round"),
    ("on each other's side", "exchange the two chains, or hang them as the run asks for"),
    (
        r"has \d+ rods, not",
        "hang the chain that the protocol describes, or write its rods into the protocol",
    ),
    ("no gate saw rod", "hang the rod in, or write the chain's own spacing into the protocol"),
    (
        "looks .* (thicker|thinner)",
        "measure the rods' diameter again, and how wide the beams are, and write what a beam sees",
    ),
    ("(longer|shorter) than", "measure the chain's length again and write it into the protocol"),
    (
        "gates are .* (higher|lower)",
        "measure the gates from the contact point, not from the board, and write that",
    ),
    ("post is .* (higher|lower)", "measure that post's zero against the other post's"),
    (
        "(chains? hangs?|it begins) .* (higher|lower)",
        "measure the drop again and write it into the protocol",
    ),
    ("clock is", "say how well the timer's clock is known, or compare it: rig import --help"),
    ("gravity is", "look up gravity for your latitude and height: site: in the protocol"),
    ("air speeds up", _COMPARE),
    (
        "air holds",
        "let like chains fall on both sides, which tell what the air does, or take heavier rods",
    ),
    ("incline", "set the board to the run's incline, or say how the surface is"),
    ("gave no edges", "plug the gate in, and see that it changes when a hand is in its beam"),
    (
        "sees something else",
        "clear the gate's beam and align it, or measure its height again",
    ),
    (
        "off its height|gate on channel .* (higher|lower) than",
        "measure the gate's height again and write it into the protocol",
    ),
    (
        "fit two falls",
        "put a gate there, or move one: rig check PROTOCOL says how many drops are read then",
    ),
    ("does not look like", _COMPARE),
    (
        "edges missed",
        "align the gates' beams with the chains; rig report SESSION shows which gate misses most",
    ),
    (
        "edges unexplained",
        "see that nothing else crosses the beams and that each gate has its own channel; rig "
        "report SESSION draws every edge",
    ),
    (
        "release skew",
        "adjust the releases until both chains leave together, or allow more skew in accept:",
    ),
    (
        "pulse was cut.*emergency stop",
        "drop once more; where nobody opened it, shield the stop's cable and put a capacitor of "
        "47 nF across it at the board",
    ),
    ("pulse was cut.*aborted", "drop once more"),
    ("pulse was cut", "look for a short circuit at the release's output; rig selftest tries it"),
    ("memory was full", "find the gate that flickers, and shield or unplug it"),
    (
        "certificate|no longer kept|missing, from number|restarted|identified itself",
        "look at cable and supply of the board, and drop once more; rig selftest tries it out",
    ),
)
"""What a reason says (a regular expression), and what to do then; the first that fits counts."""
ELSE = "look at the drop's edges: rig report SESSION draws them beside the fall that was expected"


def remedy(reason: str) -> str:
    """Say what to do about one reason."""
    found = (what for pattern, what in _REMEDIES if re.search(pattern, reason))
    return next(found, ELSE)


def remedies(reasons: Iterable[str]) -> list[str]:
    """Say what to do about a drop's reasons, each thing once; the general one only if alone."""
    found = list(dict.fromkeys(map(remedy, reasons)))
    return [one for one in found if one != ELSE] or found

"""Reasons as the session file has them: records with codes, and sentences alone in old files."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from rig.reasons import Reason, make_reason, plain_reason, read_record
from rig.wordings import NOTE

if TYPE_CHECKING:
    from collections.abc import Iterable

_OLD_NOTE = "note: "
_SIDE = r"(?P<side>impact|free) side"
_OLD_SENTENCES: tuple[tuple[str, str], ...] = (
    ("likeliest, but not clearly", "unclear_fault"),
    ("in the wrong way round", "gates_exchanged"),
    ("rods pile up", "rods_pile_up"),
    ("see every rod", "low_gates_miss_rods"),
    (rf"upside down on the {_SIDE}", "upside_down"),
    ("on each other's side", "chains_exchanged"),
    (r"(chain (?P<name>\S+)|each chain).* has \d+ rods, not", "rod_count"),
    (rf"no gate saw rod .* of chain (?P<name>\S+) on the {_SIDE}", "rod_missing"),
    ("looks .* (thicker|thinner)", "thickness"),
    (r"(chain (?P<name>\S+)|each chain) is .* (longer|shorter) than", "chain_length"),
    ("gates are .* (higher|lower)", "all_gates"),
    (r"the (?P<side>impact|free) side's post is", "post"),
    ("(chains? hangs?|it begins) .* (higher|lower)", "drop_height"),
    ("clock is", "clock"),
    ("gravity is", "gravity"),
    ("air speeds up", "air_accelerates"),
    ("air holds", "air"),
    ("of an incline of", "other_incline"),
    (f"gates of the {_SIDE} gave no edges", "side_silent"),
    ("gave no edges", "gate_silent"),
    ("sees something else", "gate_disagrees"),
    ("off its height", "gate_off"),
    ("gate on channel .* (higher|lower) than", "gate_height"),
    ("a further (?P<side>impact|free) gate", "two_falls_gate"),
    ("fit two falls", "two_falls"),
    (f"the {_SIDE} does not look like", "few_edges_fit"),
    ("even with what air would have to take", "air_implausible"),
    ("does not look like", "no_fall"),
    ("edges missed .* may be chance", "edges_missed_few"),
    ("edges missed", "edges_missed"),
    ("edges unexplained .* stray pulse", "edges_unexplained_few"),
    ("edges unexplained", "edges_unexplained"),
    ("edges after the passage", "later_passages"),
    ("release skew .* within its uncertainty", "release_skew_near"),
    ("release skew", "release_skew"),
    ("edges scatter", "scatter"),
    ("did not settle", "not_converged"),
    ("time stamps may be late", "late_stamps"),
    ("too short to be timed", "short_pulses"),
    ("last passages alone have V", "last_speed_differs"),
    ("last passages alone have Δz", "last_separation_differs"),
    ("edges go with the other runs", "differs_from_session"),
    ("pulse was cut.*emergency stop", "pulse_stopped"),
    ("pulse was cut.*aborted", "pulse_aborted"),
    ("pulse was cut", "pulse_cut"),
    ("memory was full", "edges_lost"),
    ("no certificate", "no_certificate"),
    ("certificate's CRC", "crc_mismatch"),
    ("no longer kept", "events_overwritten"),
    ("missing, from number", "events_missing"),
    ("restarted", "restarted"),
    ("identified itself", "no_identity"),
)
"""What sentences of files without codes say (regular expressions), and the code of each."""


def write_reasons(reasons: Iterable[Reason]) -> str:
    """Write reasons as a row has them."""
    return json.dumps([reason.record() for reason in reasons], ensure_ascii=False)


def read_reasons(text: str) -> tuple[Reason, ...]:
    """Read what `write_reasons` wrote, or the list of sentences of an old file.

    Raises
    ------
    TypeError, ValueError
        It is something else.
    """
    rows = json.loads(text)
    if not isinstance(rows, list):
        raise TypeError(f"{text:.40} is no list of reasons")
    return tuple(_read_sentence(row) if isinstance(row, str) else read_record(row) for row in rows)


def _read_sentence(text: str) -> Reason:
    if text.startswith(_OLD_NOTE):
        return make_reason(NOTE, text=text.removeprefix(_OLD_NOTE))
    for pattern, code in _OLD_SENTENCES:
        if match := re.search(pattern, text):
            values: dict[str, Any] = {n: v for n, v in match.groupdict().items() if v is not None}
            return Reason(code, values, text)
    return plain_reason(text)

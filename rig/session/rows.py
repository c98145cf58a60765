"""Which values each column of a session may have, and the drop that a row and its edges are.

Whoever reads a row, from SQLite or from the pages of a torn file, checks it here.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.boards import GATES
from rig.records import Certificate, Drop, Edge
from rig.session.reason_rows import read_reasons
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

_U16, _U32 = (1 << 16) - 1, (1 << 32) - 1
_INT64 = (1 << 63) - 1
_NS = (1 << 62) - 1  # two of them can be added: 146 years
_MOST_HZ = 10**12  # of imported times, whose unit is 1 ps; boards count far slower
CERTIFICATE_AT, FAULTS_AT, PROVENANCE_AT, ACCOUNT_AT = 6, 11, 13, 14
"""Where in a row of ``drop`` the certificate begins, and what follows it."""


class RowError(ValueError):
    """A row with a value that cannot be."""


class ColumnRule(NamedTuple):
    """Which values a column may have; `accepted` says it in words."""

    name: str
    accepted: str
    accepts: Callable[[Any], bool]


def _whole(name: str, low: int, high: int, *, or_none: bool = False) -> ColumnRule:
    def accepts(value: object) -> bool:
        return (type(value) is int and low <= value <= high) or (or_none and value is None)

    return ColumnRule(name, f"a whole number from {low} to {high}", accepts)


def _ns(name: str) -> ColumnRule:
    return _whole(name, -_NS, _NS)


def _text(name: str, *words: str) -> ColumnRule:
    if words:
        return ColumnRule(name, f"one of {', '.join(words)}", lambda value: value in words)
    return ColumnRule(name, "text", lambda value: type(value) is str)


def _json(name: str, accepted: str, read: Callable[[str], object]) -> ColumnRule:
    def accepts(value: object) -> bool:
        try:
            read(value)  # type: ignore[arg-type]
            # JSON's escapes can name halves of characters, which no file or screen takes.
            json.dumps(json.loads(value), ensure_ascii=False).encode()  # type: ignore[arg-type]
        except (TypeError, ValueError, RecursionError):
            return False
        return True

    return ColumnRule(name, accepted, accepts)


def identity(told: str) -> dict[str, Any]:
    """Read what a device or another timer is; what is calculated with must be possible.

    Raises
    ------
    TypeError, ValueError
        It is something else.
    """
    members = json.loads(told)
    if not isinstance(members, dict):
        raise TypeError(f"{told:.40} is no object")
    for name, accepts in _IDENTITY.items():
        if name in members and not accepts(members[name]):
            raise ValueError(f"{name} {members[name]!r:.40} cannot be")
    return members


_HZ = _whole("tick_hz", 1, _MOST_HZ)
_CHANNEL = _whole("channel", 0, GATES - 1)
_IDENTITY: Mapping[str, Callable[[Any], bool]] = {
    "tick_hz": _HZ.accepts,
    "clock_u": lambda u: type(u) in {int, float} and math.isfinite(u) and 0 <= u < 1,
    "beams": lambda beams: type(beams) is list and all(map(_CHANNEL.accepts, beams)),
}
_ID = _whole("id", 1, _INT64)
_RUN = _whole("run", 1, _INT64)
_REASONS = _json("reasons", "a JSON list of reasons", read_reasons)
COLUMNS: Mapping[str, Sequence[ColumnRule]] = {
    "meta": (_text("key"), _text("value")),
    "protocol": (_ID, _text("source"), _text("text")),
    "identity": (_ID, _ns("host_ns"), _json("json", "a JSON object of a device", identity)),
    "bytes": (
        _ID,
        _ns("host_ns"),
        _text("direction", "rx", "tx"),
        ColumnRule("data", "bytes", lambda value: type(value) is bytes),
    ),
    "ping": (_ID, _ns("host_send_ns"), _ns("host_recv_ns"), _whole("tick", 0, _U32)),
    "reference": (
        _ID,
        _ns("host_send_ns"),
        _ns("host_recv_ns"),
        _whole("number", 0, _U16),
        _whole("tick", 0, _U32),
    ),
    "host_break": (_ID, _ns("host_ns"), _ns("slept_ns"), _ns("stepped_ns")),
    "drop": (
        _ID,
        _RUN,
        _whole("attempt", 1, _INT64),
        _HZ,
        _whole("fire_tick", 0, _U32, or_none=True),
        _whole("initial_state", 0, _U16),
        *(
            _whole(name, 0, _U32, or_none=True)
            for name in ("events", "crc32", "overflows", "glitches", "late")
        ),
        _json("faults", "a JSON list of reasons", read_reasons),
        _whole("host_ns", -_NS, _NS, or_none=True),
        _text("provenance"),
        _whole("release_sense", -_U32, _U32, or_none=True),
        *(
            _whole(name, 0, _U32, or_none=True)
            for name in ("pulse_ticks", "pulse_end", "restarts", "supply_mv", "lowest_mv")
        ),
    ),
    "edge": (
        _whole("drop", 1, _INT64),
        _whole("idx", 0, _INT64),
        _whole("tick", -_INT64 - 1, _INT64),
        _CHANNEL,
        _whole("blocked", 0, 1),
    ),
    "run_state": (
        _ID,
        _RUN,
        _whole("attempt", 0, _INT64),
        _text("state", *RunState),
        _REASONS,
        _ns("host_ns"),
    ),
}
"""By table, in the order of the schema; a row of an older format has fewer."""


def check_row(table: str, row: Sequence[object]) -> None:
    """Check every value of a row.

    Parameters
    ----------
    table
        A name in `COLUMNS`.
    row
        All columns, in order.

    Raises
    ------
    RowError
        Which value cannot be, where, and what is accepted.
    """
    for column, value in zip(COLUMNS[table], row, strict=False):
        if not column.accepts(value):
            at = row[:2] if table == "edge" else row[0]
            raise RowError(
                f"table {table}, row {at!r:.40}: {column.name} {value!r:.40} is not "
                f"{column.accepted}"
            )
    if table == "drop" and len({value is None for value in row[CERTIFICATE_AT:FAULTS_AT]}) > 1:
        raise RowError(f"table drop, row {row[0]}: half of its certificate is missing")


def drop_of(row: Sequence[Any], edges: Iterable[Sequence[Any]]) -> Drop:
    """Make a drop of its row and the rows of its edges, all checked."""
    _, run, attempt, tick_hz, fire_tick, initial_state, events, *counts = row[:FAULTS_AT]
    return Drop(
        run=run,
        attempt=attempt,
        tick_hz=tick_hz,
        edges=tuple(Edge(tick, channel, bool(blocked)) for _, _, tick, channel, blocked in edges),
        fire_tick=fire_tick,
        initial_state=initial_state,
        # A row of the first format has no release sense.
        certificate=None if events is None else Certificate(events, *counts, *row[ACCOUNT_AT:]),
        faults=read_reasons(row[FAULTS_AT]),
    )

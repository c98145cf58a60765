"""Which table a record is of, told by its shape: a torn file need not have its schema any more."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from rig.recover.pages import read_cells
from rig.session.foreign import members, texts
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.recover.pages import PageCell, Pages, Value

Row: TypeAlias = "tuple[Value, ...]"

_STATES = frozenset(RunState)
_U32 = 1 << 32
_TRIP_NS = 60 * 10**9  # no answer takes longer


@dataclass
class Rows:
    """The rows of a session, by table; those with a number by it. `bad` counts unreadable ones."""

    meta: dict[str, str] = field(default_factory=dict)
    protocol: tuple[str, str] | None = None
    identity: dict[int, Row] = field(default_factory=dict)
    bytes: dict[int, Row] = field(default_factory=dict)
    ping: dict[int, Row] = field(default_factory=dict)
    reference: dict[int, Row] = field(default_factory=dict)
    host_break: dict[int, Row] = field(default_factory=dict)
    drop: dict[int, Row] = field(default_factory=dict)
    edge: dict[int, dict[int, Row]] = field(default_factory=dict)
    run_state: dict[int, Row] = field(default_factory=dict)
    bad: int = 0

    def any(self) -> bool:
        """Whether anything of a session was found."""
        return bool(self.meta or self.protocol or self.bytes or self.drop or self.run_state)


def find_rows(pages: Pages) -> Rows:
    """Read every record of every page.

    A page that SQLite has given back may still hold what another holds by now. Raw records are
    never altered, so both say the same, and the first counts. Results are left out: they are
    computed again.
    """
    rows = Rows()
    for number in sorted(pages.pages):
        cells, bad = read_cells(pages, number)
        rows.bad += bad
        for cell in cells:
            _sort(rows, cell)
    return rows


def gaps(numbers: dict[int, Row]) -> int:
    """Count the rows that are missing: a session numbers its rows from 1 without gaps."""
    return max(numbers) - len(numbers) if numbers else 0


def _sort(rows: Rows, cell: PageCell) -> None:
    rowid, values = cell
    if rowid is None:
        match values:
            case (int(drop), int(index), int(), int(), 0 | 1):
                rows.edge.setdefault(drop, {}).setdefault(index, values)
        return
    if rowid < 1:
        return
    match values:
        case (str(key), str(value)):
            rows.meta.setdefault(key, value)
        case (None, str(source), str(text)):
            rows.protocol = rows.protocol or (source, text)
        case (None, int(), "rx" | "tx", bytes()):
            rows.bytes.setdefault(rowid, values)
        case (None, int(), str(text)) if _reads(members, text):
            rows.identity.setdefault(rowid, values)
        case (None, int(sent), int(received), int(tick)):
            trip = 0 <= received - sent <= _TRIP_NS and 0 <= tick < _U32
            (rows.ping if trip else rows.host_break).setdefault(rowid, values)
        case (None, int(), int(), int(), int()):
            rows.reference.setdefault(rowid, values)
        case (None, int(run), int(), str(state), str(reasons), int()) if (
            run >= 1 and state in _STATES and _reads(texts, reasons)
        ):
            rows.run_state.setdefault(rowid, values)
        case (None, int(run), int(attempt), int(hz), *_) if _is_drop(values, run, attempt, hz):
            rows.drop.setdefault(rowid, values)


def _is_drop(values: Row, run: int, attempt: int, hz: int) -> bool:
    if len(values) not in {14, 15, 20} or run < 1 or attempt < 1 or hz < 1:
        return False
    numbers = [*values[4:11], values[12], *values[14:]]
    return (
        all(value is None or isinstance(value, int) for value in numbers)
        and isinstance(values[5], int)
        and len({value is None for value in values[6:11]}) == 1  # of a certificate all or nothing
        and isinstance(values[11], str)
        and _reads(texts, values[11])
        and isinstance(values[13], str)
    )


def _reads(read: Callable[[str], object], text: str) -> bool:
    try:
        read(text)
    except (TypeError, ValueError, RecursionError):
        return False
    return True

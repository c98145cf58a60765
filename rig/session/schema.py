"""Tables of a session file as declared in ``tables.txt``: creation, upgrade, reading and checks.

Triggers prevent changes of raw records.
"""

import json
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum
from types import GenericAlias
from typing import Annotated, Any, NamedTuple, TypeAlias, TypedDict

import msgspec

from rig.boards import GATES
from rig.printable import encodable
from rig.reasons import NOTE, SENTENCE, Reason, plain_reason, read_record
from rig.text_rows import read_paragraphs

Row: TypeAlias = tuple[Any, ...]
Record: TypeAlias = Mapping[str, Sequence[Sequence[object]]]
"""Rows that belong together, by table."""

APPLICATION_ID = int.from_bytes(b"CHRG", "big")
"""In the SQLite header: this database is a chain-rig session."""

SCHEMA_VERSION = 5
"""Stored in SQLite's ``user_version``; a program refuses files with a higher version."""

OLDER = "older"
"""Replaces a table's name in the hash chain: rows existed before the chain began."""
_OLD_NOTE = "note: "


Reasons: TypeAlias = tuple[Reason, ...]


class RunState(StrEnum):
    """State of a planned run; the log of states is append-only."""

    PLANNED = "planned"
    ARMED = "armed"
    FIRED = "fired"
    RECORDED = "recorded"
    ACCEPTED = "accepted"
    MARGINAL = "marginal"
    VOID = "void"
    REJECTED = "rejected"
    INTERRUPTED = "interrupted"


VERDICTS = (RunState.ACCEPTED, RunState.MARGINAL, RunState.VOID, RunState.REJECTED)
"""States that judge a recorded drop."""


class _Kind(NamedTuple):
    """A kind of value.

    Attributes
    ----------
    sql, check
        SQL type and check, with {} for the column.
    accepted
        Valid values in words.
    python
        Their type, for msgspec.
    read
        Raises for a text that is not valid all the same.
    """

    sql: str
    check: str
    accepted: str
    python: Any
    read: Callable[[str], object] | None = None

    def accepts(self, values: Sequence[object]) -> bool:
        """Whether all of some values are valid: many at once take a fraction of the time."""
        try:
            # Without the last, a text could stand for bytes.
            kind = GenericAlias(list, self.python)
            many: list[Any] = msgspec.convert(values, kind, builtin_types=(bytes,))
            deque(map(self.read, many) if self.read else (), maxlen=0)
        except (TypeError, ValueError, RecursionError, msgspec.ValidationError):
            return False
        return True


def _whole(low: int, high: int, check: str = "") -> _Kind:
    words = f"a whole number from {low} to {high}"
    return _Kind("INTEGER", check, words, Annotated[int, msgspec.Meta(ge=low, le=high)])


def _words(*words: str) -> _Kind:
    quoted = ", ".join(f"'{word}'" for word in words)
    accepted = f"one of {', '.join(words)}"
    return _Kind("TEXT", f" CHECK ({{}} IN ({quoted}))", accepted, str, words.index)


def _json(accepted: str, read: Callable[[str], object]) -> _Kind:
    """Return a kind of JSON that `read` takes."""

    def read_whole(text: str) -> None:
        read(text)
        # JSON escapes can contain lone surrogates, which no file or screen accepts.
        json.dumps(json.loads(text), ensure_ascii=False).encode()

    return _Kind("TEXT", " CHECK (json_valid({}))", accepted, str, read_whole)


def read_identity(record: str) -> dict[str, Any]:
    """Return the identity of a device or another timer; values used in calculations are checked.

    Raises
    ------
    ValueError, msgspec.ValidationError
        The record is not a valid identity.
    """
    members: dict[str, Any] = json.loads(record)
    msgspec.convert(members, _Identity)
    return members


def write_reasons(reasons: Iterable[Reason]) -> str:
    """Return reasons as text of a row."""
    return encodable(json.dumps([reason.record() for reason in reasons], ensure_ascii=False))


def read_reasons(text: str) -> Reasons:
    """Return the reasons of a text by `write_reasons`, or of a list of sentences of an old file.

    Raises
    ------
    TypeError, ValueError, msgspec.ValidationError
        The text is neither.
    """
    return tuple(map(_read_reason, msgspec.convert(json.loads(text), list)))


def _read_reason(row: object) -> Reason:
    if not isinstance(row, str):
        return read_record(row)
    code = NOTE if row.startswith(_OLD_NOTE) else SENTENCE
    return plain_reason(row.removeprefix(_OLD_NOTE), code)


_U32, _INT64 = (1 << 32) - 1, (1 << 63) - 1
_NS = (1 << 62) - 1  # the sum of two fits 64 bits: 146 years
_MOST_HZ = 10**12  # imported times have the unit 1 ps; boards count far slower
_KINDS = {
    "row": _whole(1, _INT64),
    "only": _whole(1, 1, " CHECK ({} = 1)"),
    "parent": _whole(1, _INT64, ' REFERENCES "drop" (id)'),
    "count": _whole(1, _INT64, " CHECK ({} >= 1)"),
    "index": _whole(0, _INT64, " CHECK ({} >= 0)"),
    "int64": _whole(-_INT64 - 1, _INT64),
    "uint16": _whole(0, (1 << 16) - 1),
    "uint32": _whole(0, _U32),
    "sense": _whole(-_U32, _U32),
    "ns": _whole(-_NS, _NS),
    "hz": _whole(1, _MOST_HZ, " CHECK ({} > 0)"),
    "channel": _whole(0, GATES - 1, " CHECK ({} >= 0)"),
    "bit": _whole(0, 1, " CHECK ({} IN (0, 1))"),
    "text": _Kind("TEXT", "", "text", str),
    "bytes": _Kind("BLOB", "", "bytes", bytes),
    "direction": _words("rx", "tx"),
    "state": _words(*RunState),
    "device": _json("a JSON object of a device", read_identity),
    "reasons": _json("a JSON list of reasons", read_reasons),
}


class _Identity(TypedDict, total=False):
    """What calculations use of an identity."""

    tick_hz: Annotated[int, msgspec.Meta(ge=1, le=_MOST_HZ)]
    clock_u: Annotated[float, msgspec.Meta(ge=0, lt=1)]
    beams: list[Annotated[int, msgspec.Meta(ge=0, lt=GATES)]]


class TableColumn:
    """A column: name, kind, SQL, first format with it and meaning."""

    def __init__(self, row: str, table_since: int) -> None:
        self.name, kind, self.meaning = (part.strip() for part in row.split("|"))
        word, *options = kind.split()
        self.kind, demand = _KINDS[word], " NOT NULL"
        if "empty" in options:
            self.kind, demand = self.kind._replace(python=self.kind.python | None), ""
        self.since = next((int(word) for word in options if word.isdecimal()), table_since)
        demand = " PRIMARY KEY" if "key" in options else demand
        self.sql = f'"{self.name}" {self.kind.sql}{demand}{self.kind.check.format(self.name)}'


class SessionTable:
    """An append-only table.

    Attributes
    ----------
    name
        Its name.
    columns
        Columns in order; those of later formats come last.
    since
        The first format with the table.
    meaning
        Meaning of its rows.
    numbered
        Whether its rows are numbered from 1.
    lengths
        Numbers of columns in all formats.
    order
        SQL order of its rows: their number, or the columns of a longer key.
    key
        Number of columns of the key: more than one if SQLite does not number the rows.
    insert
        Statement that adds a row of all columns; an empty id is numbered.
    """

    def __init__(self, head: str, rows: list[str]) -> None:
        words, _, self.meaning = head.partition(": ")
        self.name, *since = words.split()
        self.since = int(*since or "1")
        unique = rows.pop(0).removeprefix("  = ") if rows[0].startswith("  = ") else "id"
        self._key, *self._also = unique.split(" | ")
        self.key = len(self._key.split(", "))
        self.order = self._key if self.key > 1 else "rowid"
        self.columns = [TableColumn(row, self.since) for row in rows]
        self.numbered = rows[0].split()[2] == "row"
        self.lengths = {len(self.names(n)) for n in range(self.since, SCHEMA_VERSION + 1)}
        values = ", ".join("?" * len(rows))
        self.insert = f'INSERT INTO "{self.name}" VALUES ({values})'  # noqa: S608 - of tables.txt

    def names(self, version: int = SCHEMA_VERSION) -> list[str]:
        """Return the names of a format's columns."""
        return [column.name for column in self.columns if column.since <= version]

    def script(self, version: int) -> str:
        """Return the script that creates the table in a format."""
        name, parts = self.name, [c.sql for c in self.columns if c.since <= version]
        parts += [f"UNIQUE ({columns})" for columns in self._also]
        parts += [f"PRIMARY KEY ({self._key})"] if self.key > 1 else []
        taken = " OR ".join([_same(self._key), *(f"({_same(columns)})" for columns in self._also)])
        # "INSERT OR REPLACE" deletes without the delete trigger, so it has its own trigger.
        refuse = f"SELECT RAISE(ABORT, '{name}: raw records are never altered');"
        return f"""
CREATE TABLE "{name}" ({", ".join(parts)}) STRICT{", WITHOUT ROWID" if self.key > 1 else ""};
CREATE TRIGGER {name}_no_update BEFORE UPDATE ON "{name}" BEGIN {refuse} END;
CREATE TRIGGER {name}_no_delete BEFORE DELETE ON "{name}" BEGIN {refuse} END;
CREATE TRIGGER {name}_no_replace BEFORE INSERT ON "{name}"
WHEN EXISTS (SELECT 1 FROM "{name}" WHERE {taken}) BEGIN {refuse} END;
"""  # noqa: S608 - all names are constants of tables.txt


def _same(columns: str) -> str:
    return " AND ".join(f"{name} = NEW.{name}" for name in columns.split(", "))


_TABLES = [SessionTable(head, rows) for head, *rows in read_paragraphs(__file__, "tables.txt")]
TABLES = {table.name: table for table in _TABLES}
"""Tables by name, in the order in which a commit's rows are hashed."""

_BESIDES = """
CREATE INDEX run_state_by_run ON run_state (run, id);

-- Of older programs; results are derived, and nothing writes or reads them here any more.
CREATE TABLE result (run INTEGER NOT NULL, attempt INTEGER NOT NULL, analysis_version TEXT NOT NULL,
    json TEXT NOT NULL CHECK (json_valid(json)), PRIMARY KEY (run, attempt)) STRICT;
"""


def create_script(version: int = SCHEMA_VERSION) -> str:
    """Return the script that creates an empty session of a format inside a transaction."""
    tables = "".join(table.script(version) for table in TABLES.values() if table.since <= version)
    numbers = f"PRAGMA application_id = {APPLICATION_ID};\nPRAGMA user_version = {version};\n"
    return tables + _BESIDES + numbers


def upgrade_script(version: int) -> str:
    """Return the script that upgrades a file to this format from the previous one."""
    script = ""
    for name, table in TABLES.items():
        if table.since == version:
            script += table.script(version)
            if name == "hash":
                script += f"INSERT INTO hash VALUES (1, '{OLDER}', 0, x'');"  # noqa: S608
        else:
            added = (column.sql for column in table.columns if column.since == version)
            script += "".join(f'ALTER TABLE "{name}" ADD COLUMN {sql};\n' for sql in added)
    return f"BEGIN; {script} PRAGMA user_version = {version}; COMMIT;"

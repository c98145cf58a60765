"""A session keeps each record that it took once, whole, in order, in a chain that all can check."""

import hashlib
import json
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from rig.errors import SessionError
from rig.records import ClockSample, Drop, Edge, HostBreak, Pulse
from rig.session.reading import ByteChunk, StateEntry
from rig.session.schema import TABLES, RunState
from rig.session.store import Session
from tests.examples import examples
from tests.link.strategies import LONG, WORD

INT64 = st.integers(-(2**63), 2**63 - 1)
NS = st.integers(-(2**62) + 1, 2**62 - 1)
EDGES = st.lists(st.builds(Edge, INT64, st.integers(0, 15), st.booleans()), min_size=1, max_size=5)
TIMINGS = (
    st.builds(ClockSample, NS, NS, LONG)
    | st.builds(Pulse, NS, NS, WORD, LONG)
    | st.builds(HostBreak, NS, NS, NS)
)
MEMORY = Path("/dev/shm")
KINDS = ClockSample, Pulse, HostBreak, Drop, ByteChunk, StateEntry


def links(path):
    """Give the digests of a file's chain, and what anybody makes of its rows by tables.txt."""
    numbers = {table: '"drop"' if table == "edge" else "rowid" for table in TABLES}
    last, before = dict.fromkeys(TABLES, 0), b""
    with closing(sqlite3.connect(path)) as connection:
        for table, end, digest in connection.execute("SELECT covered, last, digest FROM hash"):
            where = f"{numbers[table]} BETWEEN {last[table] + 1} AND {end}"
            order = TABLES[table].order
            rows = connection.execute(f'SELECT * FROM "{table}" WHERE {where} ORDER BY {order}')
            text = json.dumps([table, *map(without_empty_end, rows)], default=bytes.hex)
            last[table], before = end, hashlib.sha256(before + text.encode()).digest()
            yield digest, before
        for table in TABLES.keys() - {"hash"}:
            rows = connection.execute(f'SELECT max({numbers[table]}) FROM "{table}"')
            yield last[table], rows.fetchone()[0] or 0


def without_empty_end(row):
    """Leave out the columns of later formats."""
    return row[: max(n for n, value in enumerate(row, 1) if value is not None)]


class Conservation(RuleBasedStateMachine):
    """A writer on a disk that is full at times, a reader beside it, and what should be there."""

    @initialize()
    def create(self):
        self.folder = TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None)
        self.path = Path(self.folder.name) / "session"
        self.session = Session.create(self.path, "p", "p", simulated=True, origin="")
        self.reader = Session.open(self.path, readonly=True)
        self.kept, self.waiting, self.runs = [], [], 0
        self.is_full = self.has_failed = False  # the disk; what is added, until it is committed

    def add(self, record, add, *values, is_refused=False):
        """Add a record; one that is refused is gone, one for which the disk has no room waits."""
        said = ""
        try:
            add(*values)
        except SessionError as error:
            said = str(error)
        has_failed = "disk is full" in said
        assert self.is_full or not has_failed
        self.has_failed |= has_failed
        assert bool(said) == (has_failed or (is_refused and not self.has_failed)), said
        if has_failed or not said:
            self.waiting.append((record, is_refused))
        assert self.session.pending == len(self.waiting)

    @rule(ns=NS, direction=st.sampled_from(["rx", "tx"]), size=st.sampled_from([0, 1, 9000]))
    def bytes(self, ns, direction, size):
        chunk = ByteChunk(ns, direction, b"\xff" * size)
        self.add(chunk, self.session.log_bytes, direction, ns, chunk.data)

    @rule(record=TIMINGS)
    def timing(self, record):
        self.add(record, self.session.add_timing, record)

    @rule(edges=EDGES)
    def drop(self, edges):
        self.runs += 1
        drop = Drop(self.runs, 1, 1000, tuple(edges))
        self.add(drop, self.session.add_drop, drop)

    @precondition(lambda self: self.runs)
    @rule(whole=st.booleans())
    def bad_drop(self, whole):
        """Add a drop that is there, or one of which only an edge is wrong."""
        bad = Drop(self.runs + whole, 1, 1000, (Edge(1, 1, True), Edge(2**63 * whole, 1, False)))
        self.add(bad, self.session.add_drop, bad, is_refused=True)

    @rule(ns=NS, state=st.sampled_from(RunState))
    def state(self, ns, state):
        entry = StateEntry(7, 1, state, ns, ())
        self.add(entry, self.session.add_state, 7, 1, state, ns)

    @rule(is_full=st.booleans())
    def limit(self, is_full):
        """Let the file grow no further, or as far as it likes."""
        execute = self.session.connection.execute
        pages = execute("PRAGMA page_count").fetchone()[0]
        execute(f"PRAGMA max_page_count = {pages if is_full else 1 << 30}")
        self.is_full = is_full

    @rule()
    def commit(self):
        said = ""
        try:
            self.session.commit()
        except SessionError as error:
            said = str(error)
        if "disk is full" in said:
            assert self.is_full
            self.has_failed = True
        else:
            assert bool(said) == any(is_refused for _, is_refused in self.waiting)
            self.settled()

    def settled(self):
        self.kept += [record for record, is_refused in self.waiting if not is_refused]
        self.waiting, self.has_failed = [], False

    @rule()
    def go_on(self):
        """Close the file and open it again."""
        self.limit(is_full=False)
        with suppress(SessionError):  # of what is refused
            self.session.close()
        self.settled()
        self.session = Session.open(self.path)

    @invariant()
    def only_what_is_committed_is_there(self):
        reader = self.reader
        drops, chunks = [*reader.drops()], [*reader.byte_log()]
        timings = reader.pings(), reader.pulses(), reader.host_breaks()
        kept = [[record for record in self.kept if type(record) is kind] for kind in KINDS]
        assert [*timings, drops, chunks, reader.states()] == kept

    def teardown(self):
        with self.folder:
            self.go_on()
            self.only_what_is_committed_is_there()
            self.session.close()
            self.reader.close()
            assert all(stored == derived for stored, derived in links(self.path))


TestConservation = Conservation.TestCase
TestConservation.settings = examples(40, stateful_step_count=25)

"""The session page says what ``rig analyze`` says; and the list of sessions."""

from pathlib import Path

import pytest

from rig.reasons import plain_reason
from rig.records import Job
from rig.results.whole import notes
from rig.session.schema import RunState
from rig.session.store import Session
from rig.tui.app import RigApp
from rig.tui.context import Options
from rig.tui.survey import session_list
from rig.wordings import NOTE
from tests.cli.lab import short
from tests.tui.lab import KEYS, Operator


@pytest.fixture
def recorded(finished, tmp_path) -> Path:
    """Four drops of two chains, at two inclines."""
    return finished.copy(tmp_path).rename(tmp_path / "abba.session")


async def test_drops_are_compared_and_files_are_written_from_inside(recorded, tmp_path):
    mine = tmp_path / "mine.session"
    mine.write_bytes(recorded.read_bytes())
    with Session.open(mine) as session:
        session.add_state(2, 1, RunState.ACCEPTED, 0, [plain_reason("a [draught]", NOTE)])
        session.commit()
    with Session.open(mine, readonly=True) as session:
        assert notes(session) == {Job(2, 1): "a [draught]"}

    app = RigApp(Options(session=mine, offline=True, still_s=0.0), KEYS)
    async with app.run_test(size=(120, 36)) as pilot:
        op = Operator(app, pilot)
        await op.sees("drop 1 of 4")
        await op.press("down")
        await op.sees("drop 2 of 4", "note: a [draught]")
        await op.press("e")
        await op.sees("Write files?", "mine.csv")
        await op.means()
        await op.sees("CSV files: ")
    assert (tmp_path / "mine.csv" / "edges.csv").is_file()


async def test_a_session_is_looked_at_without_a_rig_and_another_one_is_picked(recorded):
    other = recorded.with_name("zero.session")
    Session.create(other, short(), "zero.yaml", simulated=True, origin="sim://").close()
    (recorded.parent / "broken.session").write_bytes(b"nothing")
    entries = {entry.path.name: entry for entry in session_list(recorded.parent)}
    assert list(entries) == ["broken.session", "zero.session", "abba.session"]  # newest first
    assert (entries["abba.session"].drops, entries["zero.session"].drops) == (4, 0)
    assert entries["broken.session"].trouble

    app = RigApp(Options(session=other, offline=True), KEYS)
    async with app.run_test(size=(120, 36)) as pilot:
        op = Operator(app, pilot)

        async def enter():  # which right behind letters may be part of what was pasted
            await op.press("enter")
            return len(app.screen_stack) == 1

        await op.sees("No drop recorded yet")
        await op.press("o")
        await op.sees("abba.session", "4 drops", "broken.session")
        await op.press(*"abba")
        await op.until(enter)
        await op.sees("drop 1 of 4", "abba.session")
        await op.press("6", "up")
        await op.sees("drop 4 of 4")
        await op.press("o")
        await op.sees("broken.session")
        await op.press(*"broken")
        await op.until(enter)
        await op.sees("✗", "drop 4 of 4")


async def test_the_session_page_says_how_many_taught_each_other(recorded):
    app = RigApp(Options(session=recorded, offline=True), KEYS)
    async with app.run_test(size=(120, 36)) as pilot:
        op = Operator(app, pilot)
        await op.press("5")
        await op.sees("joint fit of 4 runs", "separation")
        await op.press("y", "y")
        await op.sees("skew")

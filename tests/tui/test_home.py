"""From an empty folder to a first result, and back to what was recorded: by keys and by mouse."""

import asyncio

import pytest

from rig.campaign.machine import Stage
from rig.cli import _parser
from rig.reasons import NOTE, plain_reason
from rig.records import Job
from rig.results.whole import notes
from rig.session.schema import RunState
from rig.session.store import Session
from rig.tui import client, commands
from rig.tui.context import Options
from rig.tui.survey import session_list
from tests.cli.lab import short
from tests.tui.lab import PATIENCE_S, at_screen, flat, listening, text_of

KEYS_AT_MOST = 4


async def test_a_first_g_takes_at_most_four_keys_and_what_was_begun_ends(folder, monkeypatch):
    (folder / "work").mkdir()
    monkeypatch.chdir(folder / "work")
    pressed = []

    options = Options(socket=folder / "rig.sock", countdown_s=0.2, still_s=0.0)
    async with at_screen(options) as op:
        app = op.app
        await op.play("nothing is here yet")
        await op.pilot.pause(0.3)
        assert "✗" not in flat(app)
        assert "supply" not in flat(app)
        assert app.model.stop is None

        async def press(key):
            pressed.append(key)
            await op.press(key)

        app.desk.rows = []  # as before it has looked around
        await press("enter")
        await op.at(Stage.DEVICE)
        await op.until(lambda: app.model.view and app.model.indicators.known and app.client.driving)
        await press("enter")
        await op.at(Stage.PREPARE)
        await op.see("Run 1 of 10", "Enter arms")
        await op.pilot.pause(0.7)  # it stands there to be read
        await press("enter")
        await op.at(Stage.RESULT)
        await op.see("g = 9.")
        trial = app.client.daemon
        assert trial.poll() is None
    assert trial.poll() is not None
    assert len(pressed) <= KEYS_AT_MOST


async def test_a_pico_that_waits_is_flashed_by_a_command_that_there_is(
    folder, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rig.tui.survey.waiting_drives", lambda: [tmp_path])
    asked = []

    async def record(_, *command, done=""):
        asked.append((command[0], _parser().parse(command).board))

    monkeypatch.setattr(commands, "_run", record)

    async with at_screen(Options(socket=folder / "rig.sock", still_s=0.0)) as op:
        await op.play("a Pico gets its firmware")
        await op.until(lambda: asked)
    assert asked == [("flash", "pico")]


async def test_a_daemon_that_a_screen_started_ends_by_itself(folder, monkeypatch):
    monkeypatch.setattr(client, "_IDLE_S", 1.0)

    there = asyncio.Event()

    async def connected():
        there.set()

    line = client.ReconnectingClient("sim://", folder / "rig.sock", connected)
    keeping = asyncio.get_running_loop().create_task(line.keep())
    await asyncio.wait_for(there.wait(), PATIENCE_S)
    keeping.cancel()
    assert line.daemon.poll() is None
    assert await asyncio.to_thread(line.daemon.wait, PATIENCE_S) == 0
    assert "no client for 1 s" in (folder / "rig.log").read_text()


@pytest.fixture
def recorded(finished, tmp_path):
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

    async with at_screen(Options(session=mine, offline=True, still_s=0.0), (120, 36)) as op:
        await op.play("drops are compared and written")
    assert (tmp_path / "mine.csv" / "edges.csv").is_file()


async def test_a_session_is_looked_at_without_a_rig_and_another_one_is_picked(recorded):
    other = recorded.with_name("zero.session")
    Session.create(other, short(), "zero.yaml", simulated=True, origin="sim://").close()
    (recorded.parent / "broken.session").write_bytes(b"nothing")
    entries = {entry.path.name: entry for entry in session_list(recorded.parent)}
    assert list(entries) == ["broken.session", "zero.session", "abba.session"]  # newest first
    assert (entries["abba.session"].drops, entries["zero.session"].drops) == (4, 0)
    assert entries["broken.session"].trouble

    async with at_screen(Options(session=other, offline=True), (120, 36)) as op:
        await op.play("another session is picked")


async def test_the_session_page_says_how_many_taught_each_other(recorded):
    async with at_screen(Options(session=recorded, offline=True), (120, 36)) as op:
        await op.play("how many taught each other is said")


LOOKS = 5
"""That many looks in a row must find words at the same place before they are clicked."""


def spot(app, words):
    rows = enumerate(text_of(app).splitlines())
    return next(((row.index(words), y) for y, row in rows if words in row), None)


async def click(op, words):
    seen = []

    def rests():  # what is still being laid out moves from under the pointer
        seen.append(spot(op.app, words))
        return len(seen) >= LOOKS and seen[-1] and len(set(seen[-LOOKS:])) == 1

    await op.until(rests)
    await op.pilot.click(offset=seen[-1])


async def test_a_protocol_and_stop_are_clicked(lab, fence, monkeypatch):
    monkeypatch.chdir(lab.folder)  # where files have shorter names than those that were given
    other = lab.folder / "other.yaml"
    other.write_text(fence.replace("TITLE", "The other one"), "utf-8")
    broken = lab.folder / "broken.yaml"
    broken.write_text("protocol: 1\n", "utf-8")

    async with lab.operator(files=(broken, lab.protocol, other)) as op:
        # What can be used, and not the first of the list.
        await op.see("A short fence", "Ready experiments")
        await op.drive()

        async def chosen():  # again, should the list have been laid out anew under the pointer
            await click(op, " other ")
            return "The other one" in flat(op.app)

        await op.until(chosen)
        async with listening(op) as called:
            await click(op, "STOP")
            await op.until(lambda: "stop" in called)

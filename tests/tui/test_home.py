"""From an empty folder to a first result, and what becomes of the daemon that a screen began."""

import asyncio
import shutil

from rig.campaign.machine import Stage
from rig.cli import _parser
from rig.tui import client, commands
from rig.tui.app import RigApp
from rig.tui.context import Options
from tests.tui.lab import KEYS, PATIENCE_S, Operator, flat, short_folder

KEYS_AT_MOST = 4


async def test_a_first_g_takes_at_most_four_keys_and_what_was_begun_ends(monkeypatch):
    folder = short_folder()
    (folder / "work").mkdir()
    monkeypatch.chdir(folder / "work")
    pressed = []

    options = Options(socket=folder / "rig.sock", countdown_s=0.2, still_s=0.0)
    app = RigApp(options, KEYS)
    async with app.run_test(size=(80, 24)) as pilot:
        op = Operator(app, pilot)
        await op.sees("HOME", "Try it", "New experiment", "no rig yet", "Enter open")
        await op.press("escape")
        await pilot.pause(0.3)
        assert "✗" not in flat(app)
        assert "supply" not in flat(app)
        assert app.driver.stop is None

        async def press(key):
            pressed.append(key)
            await op.press(key)

        app.desk.rows = []  # as before it has looked around
        await press("enter")
        await op.at(Stage.DEVICE)
        await op.until(lambda: app.view and app.indicators.known and app.client.driving)
        await press("enter")
        await op.at(Stage.PREPARE)
        await op.sees("Run 1 of 10", "Enter arms")
        await pilot.pause(0.7)  # it stands there to be read
        await press("enter")
        await op.at(Stage.RESULT)
        await op.sees("g = 9.")
        trial = app.client.daemon
        assert trial.poll() is None
    assert trial.poll() is not None
    assert len(pressed) <= KEYS_AT_MOST
    shutil.rmtree(folder)


async def test_a_pico_that_waits_is_flashed_by_a_command_that_there_is(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rig.tui.survey.waiting_drives", lambda: [tmp_path])
    asked = []

    async def record(_, *command, done=""):
        asked.append((command[0], _parser().parse(command).board))

    monkeypatch.setattr(commands, "_run", record)

    folder = short_folder()
    app = RigApp(Options(socket=folder / "rig.sock", still_s=0.0), KEYS)
    async with app.run_test(size=(80, 24)) as pilot:
        op = Operator(app, pilot)
        await op.sees("Pico: put the firmware on it")
        await op.press("down", "down", "enter")
        await op.sees("Write the firmware?")
        await op.means()
        await op.until(lambda: asked)
    shutil.rmtree(folder)
    assert asked == [("flash", "pico")]


async def test_a_daemon_that_a_screen_started_ends_by_itself(monkeypatch):
    monkeypatch.setattr(client, "_IDLE_S", 1.0)
    folder = short_folder()

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
    shutil.rmtree(folder)

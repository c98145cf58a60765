"""The daemon dies, texts are hostile, protocols are wrong: said at once, and recovered from."""

import asyncio
import os
import signal
import sqlite3
from contextlib import closing

from rig.campaign.machine import Stage
from rig.tui import app, client
from tests.tui.lab import PATIENCE_S, run
from tests.tui.screen import text_of


def test_all_that_waits_before_a_hanging_daemon_is_said_is_less_than_a_second():
    drawn = app._COUNTED_S  # what a slow machine takes from one tick to the next
    assert client._BEAT_S + client._SILENT_S + client._LATE_S + drawn < 1.0


def test_a_daemon_that_hangs_while_armed_is_said_and_is_not_armed_when_it_goes_on(lab):
    async def work():
        lab.patience_s = client._SILENT_S
        async with lab.ready(countdown_s=600.0) as op:
            await op.arms(Stage.COUNTDOWN)
            os.kill(lab.daemons[0].pid, signal.SIGSTOP)
            try:
                await op.sees("no daemon: no answer for", "an armed board has switched itself off")
                assert op.app.flow.stage is Stage.PREPARE
                await op.press("f9")
                await op.sees("STOP NOT CONFIRMED: switch the release's supply off")
            finally:
                os.kill(lab.daemons[0].pid, signal.SIGCONT)
            await op.sees("the daemon was lost before the release: nothing fell")
            await op.until(lambda: op.app.follower.state.line(1).state == "interrupted")
            await op.until(lambda: op.app.follower.state.phase == "idle")

    run(work())


def test_a_disk_that_takes_nothing_is_said(lab):
    async def work():
        async with lab.ready() as op:
            with closing(
                sqlite3.connect(lab.session, PATIENCE_S, check_same_thread=False)
            ) as other:
                await asyncio.to_thread(other.execute, "BEGIN IMMEDIATE")
                await op.sees("the disk has not finished a write for", "armed board has switched")
            await op.until(lambda: "the disk" not in text_of(op.app))

    run(work())


def test_a_wrong_protocol_is_located_and_read_again_when_it_is_mended(lab, fence):
    good = fence.replace("TITLE", "mended")
    lab.protocol.write_text(good.replace("rods: 8 ", "rods: many "), "utf-8")

    async def work():
        async with lab.operator() as op:
            await op.until(lambda: op.app.client.driving)
            await op.sees("fence.yaml:8:11:", "found 'many'")
            await op.press("enter")
            lab.protocol.write_text(good, "utf-8")
            await op.sees("mended")
            assert op.app.flow.stage is Stage.PROTOCOL

    run(work())


def test_a_daemon_of_another_port_is_named(lab):
    lab.url = "sim://?seed=99"

    async def work():
        async with lab.operator() as op:
            await op.sees("the daemon has sim://?seed=3, not sim://?seed=99", "--name")

    run(work())

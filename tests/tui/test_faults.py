"""Daemon, cable, disk and protocol fail before each screen: said at once, and recovered from."""

import asyncio
import os
import signal
import sqlite3
from contextlib import closing

import pytest

from rig.campaign.machine import Stage
from rig.tui import app, client
from tests.cli.lab import drops_of
from tests.tui.lab import PATIENCE_S, session_on, text_of


def test_all_that_waits_before_a_hanging_daemon_is_said_is_less_than_a_second():
    # The last is what a slow machine takes from one tick to the next.
    assert client._BEAT_S + client._SILENT_S + client._LATE_S + app._COUNTED_S < 1.0


async def test_a_daemon_that_hangs_while_armed_is_said_and_is_not_armed_when_it_goes_on(lab):
    lab.patience_s = client._SILENT_S
    async with lab.ready(countdown_s=600.0) as op:
        await op.arm(Stage.COUNTDOWN)
        os.kill(lab.daemons[0].pid, signal.SIGSTOP)
        try:
            await op.see("no daemon: no answer for", "an armed board has switched itself off")
            assert op.app.model.flow.stage is Stage.PREPARE
            await op.press("f9")
            await op.see("STOP NOT CONFIRMED: switch the release's supply off")
        finally:
            os.kill(lab.daemons[0].pid, signal.SIGCONT)
        await op.see("the daemon was lost before the release: nothing fell")
        await op.until(lambda: op.app.model.state.line(1).state == "interrupted")
        await op.until(lambda: op.app.model.state.phase == "idle")


async def test_a_disk_that_takes_nothing_is_said(lab):
    async with lab.ready() as op:
        with closing(sqlite3.connect(lab.session, PATIENCE_S, check_same_thread=False)) as other:
            await asyncio.to_thread(other.execute, "BEGIN IMMEDIATE")
            await op.see("the disk has not finished a write for", "armed board has switched")
        await op.until(lambda: "the disk" not in text_of(op.app))


async def test_a_wrong_protocol_is_located_and_read_again_when_it_is_mended(lab, fence):
    good = fence.replace("TITLE", "mended")
    lab.protocol.write_text(good.replace("rods: 8 ", "rods: many "), "utf-8")

    async with lab.operator() as op:
        await op.until(lambda: op.app.client.driving)
        await op.see("fence.yaml:8:11:", "found 'many'")
        await op.press("enter")
        lab.protocol.write_text(good, "utf-8")
        await op.see("mended")
        assert op.app.model.flow.stage is Stage.PROTOCOL


async def test_a_daemon_of_another_port_is_named(lab):
    lab.url = "sim://?seed=99"

    async with lab.operator() as op:
        await op.see("the daemon has sim://?seed=3, not sim://?seed=99", "--name")


PULLED = ("✗ the port is lost", "reconnecting")


def pull(processes, lab):
    processes.hand("pull 3600")


def plug(processes):
    processes.hand("pull 0")  # and in again at once


def kill(processes, lab):
    lab.kill()


async def mended(op):
    await op.until(lambda: op.app.model.state.link == "up" and op.app.client.driving)
    await op.until(lambda: op.app.model.state.section("session"))


async def test_a_pulled_cable_is_said_on_every_screen(cabled):
    processes, lab = cabled

    async with lab.operator(countdown_s=0.1) as op:
        await op.until(lambda: op.app.model.state.link == "up")
        pull(processes, lab)  # before there is a session
        await op.see(*PULLED, "HOME")
        plug(processes)
        await op.until(lambda: op.app.model.state.link == "up")
        await session_on(op)
        pull(processes, lab)
        for page in "123456":
            await op.press(page)
            await op.see(*PULLED)
        plug(processes)
        await mended(op)
        await op.see("the port was lost and is back")
        await op.press("enter")
        await op.arm(Stage.RESULT)
        pull(processes, lab)
        await op.see(*PULLED, "RESULT")
        assert op.app.model.flow.verdict == "accepted"  # stays until it is acknowledged


@pytest.mark.parametrize("fault", [pull, kill])
def test_a_drop_that_falls_without_its_line_is_found_when_it_is_back(cabled, fault):
    processes, lab = cabled

    async def work():
        async with lab.operator(countdown_s=0.1) as op:
            await op.until(lambda: op.app.model.state.link == "up")
            await session_on(op)
            await op.press("enter")
            await op.arm(Stage.LIVE)
            job = op.app.model.flow.job
            await asyncio.to_thread(fault, processes, lab)
            if fault is pull:
                await op.see("the port is lost")
                plug(processes)
            else:
                await op.see("no daemon")
            await op.at(Stage.RESULT)
            again = f"attempt {job.attempt}" * (job.attempt > 1)  # the first goes without saying
            await op.see("Run 1 of 2", again, "ACCEPTED")
        return job

    job = asyncio.run(work())
    assert drops_of(lab.session) == [job]

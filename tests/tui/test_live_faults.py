"""Cable, board and daemon fail while each screen is open: said at once, mended by itself."""

from __future__ import annotations

import asyncio

import pytest

from rig.campaign.events import Stage
from rig.session.store import Session
from tests.tui.lab import run

PULLED = ("✗ the port is lost", "reconnecting")
RESTARTED = ("✗ the port was lost and is back: the board restarted", "check its power supply")


def pull(processes, lab):
    processes.hand("pull 3600")


def plug(processes):
    processes.hand("pull 0")  # and in again at once


def reset(processes, lab):
    processes.hand("reset")


def kill(processes, lab):
    lab.kill()


async def mended(op):
    await op.until(lambda: op.app.follower.state.link == "up" and op.app.client.driving)
    await op.until(lambda: op.app.follower.state.section("session"))


async def session_on(op):
    await op.until(lambda: op.app.client.driving and op.app.follower.state.link == "up")
    await op.press("enter")
    await op.at(Stage.DEVICE)
    await op.until(lambda: op.app.view and op.app.indicators.known)


def test_a_pulled_cable_is_said_on_every_screen(cabled):
    processes, lab = cabled

    async def work():
        async with lab.operator(countdown_s=0.1) as op:
            await op.until(lambda: op.app.follower.state.link == "up")
            pull(processes, lab)  # before there is a session
            await op.sees(*PULLED, "PROTOCOL")
            plug(processes)
            await session_on(op)
            pull(processes, lab)
            for page in "123456":
                await op.press(page)
                await op.sees(*PULLED)
            plug(processes)
            await mended(op)
            await op.sees("the port was lost and is back")
            await op.press("enter")
            await op.arms(Stage.RESULT)
            pull(processes, lab)
            await op.sees(*PULLED, "RESULT")
            assert op.app.flow.verdict == "accepted"  # stays until it is acknowledged

    run(work())


@pytest.mark.parametrize("fault", [pull, kill])
def test_a_drop_that_falls_without_its_line_is_found_when_it_is_back(cabled, fault):
    processes, lab = cabled

    async def work():
        async with lab.operator(countdown_s=0.1) as op:
            await session_on(op)
            await op.press("enter")
            await op.arms(Stage.LIVE)
            job = op.app.flow.job
            await asyncio.to_thread(fault, processes, lab)
            if fault is pull:
                await op.sees("the port is lost")
                plug(processes)
            else:
                await op.sees("no daemon")
            await op.at(Stage.RESULT)
            await op.sees(f"run 1, attempt {job.attempt}", "ACCEPTED")
        return job

    job = run(work())
    with Session.open(lab.session, readonly=True) as session:
        assert [(drop.run, drop.attempt) for drop in session.drops()] == [job]


def test_what_was_armed_is_not_when_the_line_breaks(cabled):
    processes, lab = cabled

    async def work():
        async with lab.operator(countdown_s=600.0) as op:
            await session_on(op)
            await op.press("enter")
            await op.arms(Stage.COUNTDOWN)
            attempt = op.app.flow.job.attempt
            reset(processes, lab)
            await op.at(Stage.PREPARE)  # at once: long before the count is over
            await mended(op)
            await op.sees("nothing fell", f"RUN 1 of 2 · attempt {attempt + 1}")

    run(work())


def test_a_board_that_restarts_is_said_and_its_lost_drop_is_repeated(cabled):
    processes, lab = cabled

    async def work():
        async with lab.operator(countdown_s=0.1) as op:
            await session_on(op)
            reset(processes, lab)
            await op.sees(*RESTARTED)
            await mended(op)
            await op.press("enter")
            await op.arms(Stage.LIVE)
            attempt = op.app.flow.job.attempt
            reset(processes, lab)
            await op.sees("restarted")
            await mended(op)
            await op.at(Stage.PREPARE)
            await op.sees(f"RUN 1 of 2 · attempt {attempt + 1}")

    run(work())

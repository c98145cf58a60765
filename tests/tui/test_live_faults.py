"""Cable, board and daemon fail while each screen is open: said at once, mended by itself."""

import asyncio

import pytest

from rig.campaign.machine import Stage
from rig.session.store import Session
from tests.tui.lab import run


def pull(processes, lab):
    processes.hand("pull 3600")


def plug(processes):
    processes.hand("pull 0")  # and in again at once


def kill(processes, lab):
    lab.kill()


async def session_on(op):
    await op.until(lambda: op.app.client.driving and op.app.follower.state.link == "up")
    await op.press("enter")
    await op.at(Stage.DEVICE)
    await op.until(lambda: op.app.view and op.app.indicators.known)


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
            again = f"attempt {job.attempt}" * (job.attempt > 1)  # the first goes without saying
            await op.sees("Run 1 of 2", again, "ACCEPTED")
        return job

    job = run(work())
    with Session.open(lab.session, readonly=True) as session:
        assert [(drop.run, drop.attempt) for drop in session.drops()] == [job]

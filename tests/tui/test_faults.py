"""The daemon dies, texts are hostile, protocols are wrong: said at once, and recovered from."""

from __future__ import annotations

import asyncio

import pytest

from rig.campaign.machine import Stage
from tests.tui.lab import run
from tests.tui.screen import text_of


@pytest.mark.parametrize("page", "123456")
def test_a_killed_daemon_is_said_replaced_and_gone_on_with(lab, page):
    async def work():
        async with lab.ready() as op:
            await op.press(page)
            await asyncio.to_thread(lab.kill)
            await op.sees("no daemon", "switch the release's supply off")
            await recovered(op, lab)
            await op.until(lambda: "no daemon" not in text_of(op.app))
            await op.press("3")
            await op.arms(Stage.RESULT)
            await op.sees("ACCEPTED")

    run(work())


async def recovered(op, lab):
    """Wait until another daemon has the session open."""
    old = lab.daemons[0].pid
    await op.until(
        lambda: op.app.state.section("daemon").get("pid") != old and op.app.state.section("session")
    )


def test_a_daemon_killed_while_armed_is_said(lab):
    async def work():
        async with lab.ready(countdown_s=600.0) as op:
            await op.arms(Stage.COUNTDOWN)
            attempt = op.app.flow.job.attempt
            await asyncio.to_thread(lab.kill)
            await op.at(Stage.PREPARE)
            await recovered(op, lab)
            await op.sees(f"RUN 1 of 3 · attempt {attempt + 1}")

    run(work())


@pytest.mark.parametrize(
    "title",
    ["'[red]x[/'", "'[/]'", "'" + "long " * 400 + "'", "'[@click=app.exit]a'"],
)
def test_hostile_titles_are_shown_as_they_are(lab, fence, title):
    lab.protocol.write_text(fence.replace("TITLE", title), "utf-8")

    async def work():
        async with lab.ready() as op:
            for page in "123456":
                await op.press(page)
                await op.until(lambda: op.app.page != "")
                assert "\x1b" not in text_of(op.app)
            if title.startswith("'[red"):
                await op.sees("[red]x[/")

    run(work())


def test_a_wrong_protocol_is_located_and_read_again_when_it_is_mended(lab, fence):
    good = fence.replace("TITLE", "mended")
    lab.protocol.write_text(good.replace("8, length", "many, length"), "utf-8")

    async def work():
        async with lab.operator() as op:
            await op.until(lambda: op.app.client.driving)
            await op.sees("✗ this cannot be used", "fence.yaml:4:")
            await op.press("enter")
            lab.protocol.write_text(good, "utf-8")
            await op.sees("mended")
            assert op.app.flow.stage is Stage.PROTOCOL

    run(work())


def test_a_daemon_of_another_port_is_named(lab):
    lab.url = "sim://?seed=99"

    async def work():
        async with lab.operator() as op:
            await op.sees("the daemon has sim://?seed=3, not sim://?seed=99", "--socket")

    run(work())


def test_every_terminal_size_can_be_used(lab):
    async def work():
        for size in ((80, 24), (120, 36), (200, 60), (40, 12)):
            async with lab.operator(size) as op:
                await op.until(lambda: op.app.client.up)
                for page in "123456":
                    await op.press(page)
                await op.sees("STOP")

    run(work())

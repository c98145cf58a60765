"""Text and spans on a page have their height, whatever moment they come at."""

from __future__ import annotations

import asyncio

import pytest
from textual.app import App

from rig.tui.braille import Span
from rig.tui.widgets.spans import SpanView
from rig.tui.widgets.text import Words


@pytest.mark.parametrize("kind", [Words, SpanView])
def test_there_is_room_for_what_comes_before_a_wish_for_room_is_seen_to(kind):
    """Between such a wish and the next idle moment everything may be placed for others."""
    asyncio.run(_said_between(kind()))


async def _said_between(shown: Words | SpanView) -> None:
    app: App[None] = App()
    async with app.run_test(size=(80, 24)) as pilot:
        shown.styles.height = "auto"
        await app.mount(shown)
        await pilot.pause()
        shown.refresh(layout=True)
        app.screen._clear_arrangement_cache()  # as for another widget
        app.screen._refresh_layout()
        if isinstance(shown, Words):
            shown.say("one line\nand another")
        else:
            shown.take([[Span("one line")], [Span("and another")]])
        await pilot.pause()
        assert shown.size.height == 2

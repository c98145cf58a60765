"""Whatever looks as if it could be clicked can be."""

from rig.tui.widgets.text import Words
from tests.tui.lab import flat

LOOKS = 5
"""That many looks in a row must find a thing at the same place before it is clicked."""


def spots(app):
    """Where on the screen each action can be clicked, one place an action."""
    found = {}
    for words in app.screen.query(Words):
        if not words.region or not words.display:
            continue
        for y in range(words.content_region.height):
            x, top = words.content_region.x, words.content_region.y
            for part in words.render_line(y + top - words.region.y):
                said = part.style.meta.get("@click") if part.style else None
                if said:
                    found.setdefault(said, (x, y + top))
                x += part.cell_length
    return found


async def click(op, action):
    seen = []

    def rests():  # what is still being laid out moves from under the pointer
        seen.append(spots(op.app).get(action))
        return len(seen) >= LOOKS and seen[-1] is not None and len(set(seen[-LOOKS:])) == 1

    await op.until(rests)
    x, y = seen[-1]
    assert op.app.screen.get_style_at(x, y).meta["@click"] == action
    await op.pilot.click(offset=(x, y))


async def test_a_protocol_and_stop_are_clicked(lab, fence):
    other = lab.folder / "other.yaml"
    other.write_text(fence.replace("TITLE", "The other one"), "utf-8")
    broken = lab.folder / "broken.yaml"
    broken.write_text("protocol: 1\n", "utf-8")

    async with lab.operator(files=(broken, lab.protocol, other)) as op:
        # What can be used, and not the first of the list.
        await op.sees("A short fence", "Ready experiments")
        await op.until(lambda: op.app.client and op.app.client.driving)

        async def chosen():  # again, should the list have been laid out anew under the pointer
            rows = [row.title for row in op.app.desk.rows]
            await click(op, f"app.choose({rows.index('other')})")
            return "The other one" in flat(op.app)

        await op.until(chosen)
        stopped = []
        real = op.app.client.call

        async def call(method, **params):
            stopped.append(method)
            return await real(method, **params)

        op.app.client.call = call
        await click(op, "app.do('stop')")
        await op.until(lambda: "stop" in stopped)

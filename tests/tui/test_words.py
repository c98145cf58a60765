"""Text from outside on the screen: no markup, no control characters, no endless lines."""

from dataclasses import replace

import pytest

from rig.campaign.machine import Flow, GoOn, Stage, step
from rig.reasons import make_reason, plain_reason, remedies
from rig.records import Job
from rig.tui.indicators import Indicators
from rig.tui.model import Model
from rig.tui.pages.drop import verdict_words
from rig.tui.state import read_state
from rig.tui.widgets.bars import headline, hints
from tests.tui.lab import KEYS

NASTY = ["[red]x[/", "[/]", "\x1b[2J\x07\x9b31m", "x" * 10_000, "[@click=app.exit]a", "a\nb\u202ec"]


def model(text):
    state = {"port": {"url": text, "simulated": True}, "session": {"title": text, "path": text},
             "control": {"client": text}, "link": {"state": "up"}}  # fmt: skip
    flow = Flow(Stage.RESULT, Job(1, 1), verdict="void", reasons=(plain_reason(text),))
    return Model(read_state(0, state), flow, Indicators(), connected=True, port=text)


@pytest.mark.parametrize("text", NASTY, ids=range(len(NASTY)))
def test_what_comes_from_outside_is_shown_as_text(text):
    shown = [headline(replace(model(text), page="run"), 78), verdict_words(model(text))]
    for content in shown:
        assert not any(ord(letter) < 32 and letter != "\n" for letter in content.plain)
        assert not any("\x7f" <= letter <= "\x9f" for letter in content.plain)
        assert len(content.plain) < 500
    if text.isprintable() and len(text) < 20:
        assert all(text in content.plain for content in shown)
    assert len(shown[0].plain) == 78
    assert "▲ SIMULATED" in shown[0].plain


def test_a_void_drop_says_what_to_do():
    reason = make_reason("release_skew", skew_s=9.19e-3, limit_s=5e-3)
    flow = Flow(Stage.RESULT, Job(1, 1), verdict="void", reasons=(reason,))
    (advice,) = remedies([reason])
    words = verdict_words(replace(model("x"), flow=flow)).plain
    assert words.endswith(f"{reason.text}\n  → {advice}")


def test_enter_is_not_offered_before_the_verdict_is_kept():
    """It would do nothing: what comes next depends on the verdict."""
    waits = replace(model("x"), driving=True)
    kept, job = replace(waits, flow=replace(waits.flow, logged=True)), Job(2, 1)
    waits = replace(waits, flow=replace(waits.flow, logged=False))
    assert step(waits.flow, GoOn(job, 0.0)) == (waits.flow, ())
    assert (
        "Enter after the verdict is saved"
        in hints(replace(waits, page="result"), KEYS, 80, lambda _: True).plain
    )
    assert step(kept.flow, GoOn(job, 0.0))[0].job == job
    assert "Enter end" in hints(replace(kept, page="result"), KEYS, 80, lambda _: True).plain


@pytest.mark.parametrize("width", [20, 40, 78, 198])
def test_keys_fit_their_line(width):
    assert (
        len(hints(replace(model("x"), page="result"), KEYS, width, lambda _: True).plain) <= width
    )

"""Whatever is typed, pasted, held down or clicked: nothing is armed but by the deliberate step."""

import asyncio
import time
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from textual import events

from bench.pictures import QUIET, FakeClient
from rig.campaign.machine import Stage
from rig.results.live import LiveAnalysis
from rig.session.store import Session
from rig.tui.app import RigApp
from rig.tui.context import Options
from rig.tui.state import state_of
from tests.cli.lab import short
from tests.examples import examples
from tests.tables import read_table
from tests.tui.lab import KEYS, flow_of
from tests.waiting import PATIENCE_S

STILL_S = 0.15
MOMENTS = {name: flow_of(**row) for name, row in read_table(__file__, "moments")["typing"].items()}
PAGE_OF = {"device": "device", "result": "result", "halted": "result", "done": "session"}
DIALOGS = ("", "ctrl+p", "question_mark", "n", "a", "q", "c", "l")

WORDS = ("board moved", "laser", "quit", "cza")
PRESSED = ("enter", "escape", "f9", "up", "down", "ctrl+p", "ctrl+q", "3", "l", "a")

words = st.text(st.characters(codec="ascii", categories=["L", "N", "P", "Z"]), max_size=12)
deeds = st.one_of(
    st.tuples(st.just("type"), words | st.sampled_from(WORDS)),
    st.tuples(st.just("paste"), words),
    st.tuples(st.just("hold"), st.sampled_from(["enter", "a", "space", "l", "q", "y", "tab"])),
    st.tuples(st.just("keys"), st.lists(st.sampled_from(PRESSED), max_size=4)),
    st.tuples(st.just("click"), st.tuples(st.integers(0, 79), st.integers(0, 23))),
    st.tuples(st.just("wait"), st.sampled_from([0.0, STILL_S, 2 * STILL_S])),
)
episodes = st.lists(
    st.tuples(st.sampled_from(sorted(MOMENTS)), st.sampled_from(DIALOGS),
              st.lists(deeds, min_size=1, max_size=5)),
    min_size=3, max_size=6,
)  # fmt: skip
PRESSES = [("wait", 6 * STILL_S), ("keys", ["enter"])]
ARMS = [("prepare", "", [*PRESSES, ("told", "collect")])]
ENDS = [("prepare", "", [*PRESSES, ("type", "x"), ("told", "stop")])]
PASTES = [("prepare", "", [*PRESSES, ("paste", "x"), ("told", "stop")])]
TOO_SOON = [("keys", ["enter"]), ("wait", 4 * STILL_S)]
"""Before anybody can have read what Enter would do; and after a letter, on a page at rest."""
TYPED_ON = [("wait", 6 * STILL_S), ("type", "x"), *TOO_SOON]


class Rig(FakeClient):
    """A rig that does whatever it is told at once, and remembers it."""

    def __init__(self, state):
        super().__init__(state)
        self.told = []

    @property
    def connection(self):
        return self

    async def call(self, method, **params):
        self.told.append((time.monotonic(), method))
        await (asyncio.Event().wait() if method == "collect" else asyncio.sleep(0))
        return {"token": 1} if method == "arm" else None


class Hands:
    """Does things, and knows itself when Enter was pressed by itself on a run page at rest."""

    def __init__(self, app):
        self.app = app
        self.keys = []
        self.touched = self.looked = 0.0
        self.faces = [(0.0, None)]

    def look(self):
        """Note what a person would see: which page, which stage, and whether something is open.

        It may have been there since the last look: on a busy machine that is long ago.
        """
        if not self.app._open():
            return  # it was left, on purpose
        now = self.app.model.page, self.app.model.flow.stage, len(self.app.screen_stack)
        if now != self.faces[-1][1]:
            self.faces.append((self.looked, now))
        self.looked = time.monotonic()

    async def key(self, key):
        self.look()
        now = time.monotonic()
        since, face = self.faces[-1]
        alone = now - max(since, self.touched) >= 0.9 * STILL_S
        self.keys.append((now, key == "enter" and alone and face))
        self.touched = now
        character = key if len(key) == 1 else None
        self.app.post_message(events.Key({" ": "space"}.get(key, key), character))
        await asyncio.sleep(0.005)
        self.look()

    async def do(self, kind, what):
        if kind == "wait":
            end = time.monotonic() + what
            while time.monotonic() < end:
                await asyncio.sleep(0.01)
                self.look()
        elif kind == "told":  # if anything is
            await self.do("wait", 0.6)
            end = time.monotonic() + PATIENCE_S
            while (told := self.app.client.told) and told[-1][1] != what:
                assert time.monotonic() < end, told
                await asyncio.sleep(0.01)
        elif kind == "paste":
            self.touched = time.monotonic()
            self.keys.append((self.touched, False))
            self.app.post_message(events.Paste(what))
            await asyncio.sleep(0.005)
        elif kind == "click":
            self.touched = time.monotonic()
            x, y = what
            for event in (events.MouseDown, events.MouseUp):
                self.app.post_message(event(None, x, y, 0, 0, 1, False, False, False, x, y))
                await asyncio.sleep(0.005)
        else:
            for key in [what] * 8 if kind == "hold" else what:
                await self.key(key)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    path = tmp_path_factory.mktemp("typed") / "typed.session"
    Session.create(path, short(), "typed.yaml", simulated=True, origin="sim://").close()
    return path


@examples(4)
@given(episodes)
@example(ARMS)
@example(ENDS)
@example(PASTES)
@example([("prepare", "", TOO_SOON), ("prepare", "", TYPED_ON)])
@example([("prepare", "l", TOO_SOON)])
@example([("prepare", "l", TYPED_ON)])
@example([("result", "", [("type", "board moved"), ("hold", "enter"), ("wait", 0.6)])])
def test_nothing_is_armed_but_by_the_deliberate_step(session, lived):
    told, keys = asyncio.run(_typed(session, lived))
    end = time.monotonic() + PATIENCE_S
    while lived in [ARMS, ENDS, PASTES] and not told:
        # On a busy machine a page may not have stood still long enough.
        assert time.monotonic() < end
        told, keys = asyncio.run(_typed(session, lived))
    for at, method in told:
        meant = [(when, face) for when, face in keys if face and when <= at]
        if method == "wait":  # the first of what arms
            assert meant[-1][1] == ("run", Stage.PREPARE, 1)
        if method == "fire":
            assert not any(meant[-1][0] < when < at for when, _ in keys)
        if method in {"test_release", "release_control", "close_session"}:
            assert meant[-1][1][2] == 2  # Enter in a dialog that could be read
    methods = [method for _, method in told]
    if lived == ARMS:
        assert methods == ["wait", "arm", "fire", "collect"]
    if lived in [ENDS, PASTES]:
        assert "fire" not in methods
        assert methods[-1] == "stop"


async def _typed(session, lived):
    """Live through episodes at one screen; what the rig was told, and what each key meant."""
    async with _screen(session) as (app, pilot):
        hands = Hands(app)
        for moment, dialog, does in lived:
            if not app._open():
                break
            while len(app.screen_stack) > 1:
                app.screen.dismiss(None)
            app.model.flow = MOMENTS[moment]._replace(ticket=app.model.flow.ticket + 1)
            await pilot.pause(0.12)  # its page is there, unless another one was turned to
            if dialog:
                await hands.key(dialog)
            for kind, what in does:
                if not app._open():
                    break
                await hands.do(kind, what)
        return app.client.told, hands.keys


async def test_a_key_that_comes_back_from_its_field_after_the_end_is_dropped(session):
    async with _screen(session) as (app, _):
        key = events.Key("x", "x")
        key._set_forwarded()
    with app._context():
        await app.on_event(key)


async def test_stop_is_on_its_way_within_a_tenth_of_a_second(session):
    async with _screen(session) as (app, pilot):
        for moment, flow in MOMENTS.items():
            app.model.flow = flow._replace(ticket=app.model.flow.ticket + 1)
            end = time.monotonic() + PATIENCE_S
            while app._open() and app.model.page != PAGE_OF.get(moment, "run"):
                assert time.monotonic() < end, app.model.page
                await pilot.pause(0.01)
            await pilot.pause(0.12)  # it is drawn
            while (waited := await _stopped(app, pilot)) > 0.1:  # for other programs' sake
                assert time.monotonic() < end, (moment, waited)


async def _stopped(app, pilot):
    """Press STOP, where there may be one in a dialog; how long until the rig was told, s."""
    await pilot.press("question_mark")
    begun, known = time.monotonic(), len(app.client.told)
    app.post_message(events.Key("f9", None))
    while len(app.client.told) == known:
        await asyncio.sleep(0.001)
    return app.client.told[-1][0] - begun


@asynccontextmanager
async def _screen(session):
    whole = state_of(LiveAnalysis(session).read())
    sections = {**QUIET, "session": whole.sections["session"]}
    rig = Rig(replace(whole, sections=sections))
    app = RigApp(Options(session=session, countdown_s=0.3, still_s=STILL_S), KEYS, rig)
    async with app.run_test(size=(80, 24)) as pilot:
        rig.changed = True
        while not app.model.page or app.model.view is None:
            await pilot.pause(0.01)
        yield app, pilot

"""Every scene speaks its own words: in what commands print, on the page and on every screen."""

import asyncio
import re
from contextlib import closing
from html import unescape
from itertools import cycle
from pathlib import Path

import pytest

from bench import pictures
from bench.pictures import FakeClient, screenshots, seen
from rig import __version__
from rig.campaign.machine import Flow, Stage
from rig.protocol.reader import read
from rig.ready import ready_protocol
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState
from rig.records import Job
from rig.report.templates import sentence
from rig.results.live import LiveAnalysis
from rig.session.schema import RunState
from rig.tui.app import RigApp
from rig.tui.context import Options
from tests.scenes.through import lacking
from tests.tables import read_table
from tests.tui.lab import KEYS, draw_without_pause, text_of, unseen

pytestmark = pytest.mark.usefixtures("analysed_once")
SCENES = read_table(__file__, "words")["ready"]
"""What ``rig new`` drafts, and the ready scene of the same words."""
NAMES = r"\b(?:chains|rods)(?=:)|(?m:^  hang\b)|--rods|\d V\b"
"""Keys, options and volts, which are the same in every scene."""
SIZES = ((120, 36),)
GOOD, VOID = ("result", "session"), ("run", "live", "history")
DIALOGS = ("help", "palette", "reject", "again", "release_test", "note", "quit")


@pytest.fixture(scope="module", params=SCENES.values())
def recorded(request, tmp_path_factory):
    """Two short sessions of a ready scene: of good drops, and of a void one, which says more."""
    text = ready_protocol(request.param).read_text("utf-8")
    text = re.sub(
        r"repeats: \d+", "repeats: 2", re.sub(r"incline: \[.*?\]", "incline: 40 deg", text)
    )
    folder = tmp_path_factory.mktemp(request.param)
    protocol = folder / "scene.yaml"
    protocol.write_text(re.sub(r"settle: \d+ s", "settle: 1 s", text), "utf-8")
    sessions = {}
    # A fall of one object or fence is read even where gates are that far off.
    more = "seed=3&missed=60%25" if request.param in {"falling-ball", "picket-fence"} else "seed=2"
    for name, dials, runs in (("good", "seed=2", (1, 2)), ("void", f"gate_sd=12mm&{more}", (1,))):
        session = folder / f"{name}.session"
        with closing(Controller(f"sim://?{dials}", PublishedState())) as rig:
            rig.open_session(str(protocol), str(session))
            for run in runs:
                rig.fire(rig.arm(run, 1))
                rig.collect(run, 1)
                rig.log_state(run, 1, RunState.ACCEPTED if name == "good" else RunState.VOID)
        sessions[session] = live = LiveAnalysis(session)
        assert {one.verdict == "void" for one in live.read().results.values()} == {name == "void"}
    return request.param, protocol, sessions


def assert_own_words(scene: str, where: str, text: str) -> None:
    """See that no text speaks of what its scene does not have."""
    text = re.sub(r"\s+", " ", text).replace(sentence("software", __version__), "")
    for pattern in lacking(read(ready_protocol(scene))):
        met = re.search(pattern, text, re.IGNORECASE if len(pattern) > 3 else re.NOFLAG)
        assert met is None, f"{scene}, {where}: {text[max(0, met.start() - 80) : met.end() + 40]}"


def text_of_svg(path: Path) -> str:
    """What a drawing says, be it text or, where letters are curves, the comments above them."""
    svg = path.read_text("utf-8")
    svg = re.sub(r"<!--(.*?)-->", r"\1\n", svg, flags=re.DOTALL)
    return unescape(re.sub(r"<(metadata|style)\b.*?</\1>|<[^>]+>", " ", svg, flags=re.DOTALL))


@pytest.mark.parametrize(
    ("scene", "board"), [*zip(SCENES, cycle(["pico", "mega", "uno"]), strict=False)]
)
def test_a_draft_and_its_drawings_speak_the_words_of_their_scene(scene, board, tmp_path, call):
    file = tmp_path / "mine.yaml"
    done = call("new", file, "--scene", scene, "--board", board, "--yes", code={0, 3})
    drawings = {path.name: text_of_svg(path) for path in tmp_path.glob("*.svg")}
    assert set(drawings) == {"mine-mounting.svg", "mine-wiring.svg"}
    assert "gate 0" in drawings["mine-wiring.svg"]
    assert "At each beam: channel: height in mm." in drawings["mine-mounting.svg"]
    plan = re.sub(r"\nLeft out\n.*?\n\n", "\n\n", done.out, flags=re.DOTALL)
    texts = {"draft": file.read_text("utf-8"), "plan": plan, "questions": done.err, **drawings}
    for where, text in texts.items():
        assert_own_words(SCENES[scene], where, re.sub(NAMES, "", text))


def test_screens_speak_the_words_of_their_scene(recorded, monkeypatch):
    scene, protocol, sessions = recorded
    unseen(monkeypatch)
    draw_without_pause(monkeypatch)
    monkeypatch.setattr(pictures, "_quiet", lambda _: True)  # that gates flicker may be read too
    monkeypatch.setattr(pictures, "LiveAnalysis", sessions.__getitem__)
    # Before there is a result all sessions look the same, and of a void one there is more to say.
    for names, session in zip((GOOD, VOID), sessions, strict=True):
        chosen = lambda view, names=names: [s for s in screenshots(view) if s.name in names]  # noqa: E731
        monkeypatch.setattr(pictures, "screenshots", chosen)
        for page, _, _, text in seen(session, KEYS, (protocol,), SIZES, ["dark"], text_of):
            assert_own_words(scene, page, "\n".join(text.split("\n")[1:]))


def test_dialogs_speak_the_words_of_their_scene(recorded, monkeypatch):
    scene, _, sessions = recorded
    unseen(monkeypatch)
    session, live = [*sessions.items()][-1]
    view = live.read()
    job = view.jobs[-1]
    moment = next(shot for shot in screenshots(view) if shot.name == "result")

    async def opened() -> dict[str, str]:
        app = RigApp(Options(session=session), KEYS, FakeClient(moment.state))
        app.follower.look_with(live)
        texts = {}
        async with app.run_test(size=(120, 60)) as pilot:
            while app.model.view is None or not app.model.page:
                await pilot.pause(0.02)
            for name in DIALOGS:
                stage = Stage.PREPARE if name == "release_test" else Stage.RESULT
                app.model.flow = Flow(stage, Job(*job), verdict="accepted")
                app.action_do(name)
                while len(app.screen_stack) == 1:
                    await pilot.pause(0.02)
                await pilot.pause()
                texts[name] = text_of(app)
                app.screen.dismiss(None)
                while len(app.screen_stack) > 1:
                    await pilot.pause(0.02)
        return texts

    for name, text in asyncio.run(opened()).items():
        assert_own_words(scene, name, "\n".join(text.split("\n")[1:]))

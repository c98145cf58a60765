"""Every scene speaks its own words: in what commands print, on the page and on every screen."""

from __future__ import annotations

import asyncio
import re
from html import unescape

import pytest

from rig.campaign.events import Stage
from rig.campaign.machine import Flow
from rig.cli import main
from rig.ready import ready_protocol
from rig.records import Job
from rig.report.method import SOFTWARE
from rig.results.live import LiveAnalysis
from rig.tui.app import RigApp
from rig.tui.context import Options
from rig.tui.pictures import FakeClient, screenshots, seen
from tests.tui.lab import KEYS
from tests.tui.screen import text_of

_PAIR = r"\b(?:free|impact) side|\bfree chain|skew|separation|Δz|both chains"
_STRUCK = r"\bimpact|\bstr(?:ik|uck)|restitution|\bsurface"
_STRUNG = r"\brods?\b|\bchains?\b|\bh[au]ng"
_OTHERS = r"\bglider|\bfence|\bthe object"
FOREIGN = {
    "falling-ball": (_PAIR, _STRUCK, _STRUNG, "inclin"),
    "glider": (_PAIR, _STRUCK, _STRUNG),
    "picket-fence": (_PAIR, _STRUCK, _STRUNG, "inclin"),
    "single-chain": (_PAIR, _OTHERS),
    "inclined-uniform": (_OTHERS,),
}
SIZES = ((120, 36),)
DIALOGS = ("help", "palette", "reject", "again", "filter", "release_test", "note", "quit")


@pytest.fixture(scope="module", params=FOREIGN)
def recorded(request, tmp_path_factory):
    """A short session of a ready scene: with a void drop, which says more than a good one."""
    text = ready_protocol(request.param).read_text("utf-8")
    text = re.sub(
        r"repeats: \d+", "repeats: 2", re.sub(r"incline: \[.*?\]", "incline: 40 deg", text)
    )
    folder = tmp_path_factory.mktemp(request.param)
    protocol, session = folder / "scene.yaml", folder / "scene.session"
    protocol.write_text(re.sub(r"settle: \d+ s", "settle: 1 s", text), "utf-8")
    for port in ("sim://?seed=2", "sim://?seed=2&gate_sd=12mm"):
        main(["run", str(protocol), "--port", port, "--session", str(session), "--yes"])
        session.rename(session.with_suffix(f".{len(port)}"))
    return request.param, protocol, [*folder.glob("scene.[0-9]*")]


def assert_own_words(scene: str, where: str, text: str) -> None:
    """See that no text speaks of what its scene does not have."""
    text = re.sub(r"\s+", " ", text).replace(SOFTWARE, "")
    for pattern in FOREIGN[scene]:
        met = re.search(pattern, text, re.IGNORECASE)
        assert met is None, f"{scene}, {where}: {text[max(0, met.start() - 80) : met.end() + 40]}"


def test_commands_and_page_speak_the_words_of_their_scene(recorded, tmp_path, capsys):
    scene, _, sessions = recorded
    for session in sessions:
        capsys.readouterr()
        main(["analyze", str(session), "--scatter"])
        main(["report", str(session), "-o", str(tmp_path / "page.html")])
        assert_own_words(scene, "analyze", "".join(capsys.readouterr()))
        html = (tmp_path / "page.html").read_text("utf-8")
        html = re.sub(r"<!--(.*?)-->", r"\1\n", html, flags=re.DOTALL)  # the texts of figures
        html = re.sub(r"<(style|pre|title|h1|dl|a)\b.*?</\1>", "", html, flags=re.DOTALL)
        assert_own_words(scene, "page", unescape(re.sub(r"<[^>]+>", "\n", html)))


def test_screens_speak_the_words_of_their_scene(recorded):
    scene, protocol, sessions = recorded
    for session in sessions:
        for page, _, _, text in seen(session, KEYS, (protocol,), SIZES, ["dark"], text_of):
            if page != "protocol":
                assert_own_words(scene, page, "\n".join(text.split("\n")[1:]))


def test_dialogs_speak_the_words_of_their_scene(recorded):
    scene, _, sessions = recorded
    view = LiveAnalysis(sessions[-1]).read()
    job = view.jobs[-1]
    moment = next(shot for shot in screenshots(view) if shot.name == "result")

    async def opened() -> dict[str, str]:
        app = RigApp(Options(session=sessions[-1]), KEYS, FakeClient(moment.state))
        texts = {}
        async with app.run_test(size=(120, 60)) as pilot:
            while app.view is None or not app.page:
                await pilot.pause(0.02)
            for name in DIALOGS:
                stage = Stage.PREPARE if name == "release_test" else Stage.RESULT
                app.driver.flow = Flow(stage, Job(*job), verdict="accepted")
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

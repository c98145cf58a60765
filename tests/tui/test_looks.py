"""What stands on the screens, at three sizes, against text files.

``GOLDENS=write ./run test tests/tui/test_looks.py`` writes the files anew; look at the difference.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from rig.session.store import Session
from rig.tui.app import RigApp
from rig.tui.book import Book
from rig.tui.flow import Flow, Stage
from rig.tui.options import Options
from rig.tui.plan import Job
from rig.tui.still import QUIET, Still
from tests.cli.lab import short
from tests.tui.lab import KEYS, run
from tests.tui.screen import text_of

GOLDENS = Path(__file__).parent / "goldens"
SIZES = ((80, 24), (120, 36), (200, 60))
BLOCKED = {"gates": {"blocked": 1 << 3, "age_s": 0.1}}
MOMENTS = {
    "device": (Flow(Stage.DEVICE), BLOCKED),
    "run": (Flow(Stage.PREPARE, Job(1, 1)), {}),
    "trouble": (
        Flow(Stage.PREPARE, Job(1, 2)),
        {"link": {"state": "down", "error": {"message": "no such device"}, "retry_s": 2.0}},
    ),
    "session": (Flow(Stage.DONE), {}),
    "help": (Flow(Stage.DEVICE), {}),
    "note": (Flow(Stage.RESULT, Job(1, 1), verdict="void", reasons=("[a gate] was lost",)), {}),
}


@pytest.mark.parametrize("size", SIZES, ids="{0[0]}x{0[1]}".format)
@pytest.mark.parametrize("moment", MOMENTS)
def test_a_screen_looks_as_it_did(moment, size, tmp_path):
    path = tmp_path / "looks.session"
    Session.create(path, short(), "looks.yaml", simulated=True, origin="sim://").close()
    text = run(_screen(moment, size, path))
    golden = GOLDENS / f"{moment}-{size[0]}x{size[1]}.txt"
    if os.environ.get("GOLDENS") == "write":
        GOLDENS.mkdir(exist_ok=True)
        golden.write_text(text + "\n", "utf-8")
    assert text + "\n" == golden.read_text("utf-8")


async def _screen(moment, size, path):
    flow, more = MOMENTS[moment]
    whole = Book(path).read().state()
    state = replace(whole, sections={**QUIET, **more, "session": whole.sections["session"]})
    app = RigApp(Options(session=path), KEYS, Still(state))
    app.flow = flow
    async with app.run_test(size=size) as pilot:
        while app.findings is None or not app.lamps.known:
            await pilot.pause()
        if moment == "help":
            await pilot.press("question_mark")
        if moment == "note":
            await pilot.press("n", *"warm")
        before, text = "", text_of(app)
        while before != text:
            await pilot.pause(0.6)  # figures are drawn at most twice a second
            before, text = text, text_of(app)
        return text

"""What is drawn where there is only ASCII."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.pictures import QUIET, FakeClient
from rig.campaign.machine import Flow, Stage
from rig.tui.app import RigApp
from rig.tui.ascii import in_ascii
from rig.tui.context import Options, ascii_only
from rig.tui.state import DaemonState
from tests.tui.lab import KEYS, run
from tests.tui.screen import text_of


@given(st.text(st.characters(exclude_categories=["M", "C"])))
def test_every_text_keeps_its_length_and_is_ascii(text):
    assert in_ascii(text).isascii()
    assert len(in_ascii(text)) == len(text)


def test_what_matters_can_still_be_told():
    assert in_ascii("Δz 8.79 ± 0.02 cm at 40°") == "dz 8.79+/-0.02 cm at 40'"
    assert in_ascii("⠉⣀⡇⣿ ") == "'.:# "


@pytest.mark.parametrize(
    ("environment", "true"),
    [
        ({}, False),
        ({"LANG": "de_DE.UTF-8"}, False),
        ({"LANG": "C.utf8", "LC_ALL": ""}, False),
        ({"LANG": "de_DE.UTF-8", "LC_ALL": "C"}, True),
        ({"LC_CTYPE": "en_US.ISO-8859-1"}, True),
        ({"LANG": "de_DE.UTF-8", "TERM": "linux"}, True),
    ],
)
def test_terminal_and_locale_say_when(environment, true):
    assert ascii_only(environment) is true


def test_a_whole_screen_is_ascii():
    async def work():
        app = RigApp(Options(ascii=True), KEYS, FakeClient(DaemonState(0, QUIET)))
        app.driver.flow = Flow(Stage.DEVICE)
        async with app.run_test(size=(80, 24)) as pilot:
            while "DEVICE" not in text_of(app):
                await pilot.pause()
            assert text_of(app).isascii()
            assert "# STOP  F9 or Esc" in text_of(app)

    run(work())

"""What is drawn where there is only ASCII."""

from hypothesis import given
from hypothesis import strategies as st

from bench.pictures import QUIET, FakeClient
from rig.campaign.machine import Flow, Stage
from rig.tui.app import RigApp
from rig.tui.ascii import in_ascii
from rig.tui.context import Options, ascii_only
from rig.tui.state import DaemonState
from tests.tables import cases
from tests.tui.lab import KEYS, text_of


@given(st.text(st.characters(exclude_categories=["M", "C"])))
def test_every_text_keeps_its_length_and_is_ascii(text):
    assert in_ascii(text).isascii()
    assert len(in_ascii(text)) == len(text)


def test_what_matters_can_still_be_told():
    assert in_ascii("Δz 8.79 ± 0.02 cm at 40°") == "dz 8.79+/-0.02 cm at 40'"
    assert in_ascii("⠉⣀⡇⣿ ") == "'.:# "


@cases
def test_terminal_and_locale_say_when(environment, is_ascii):
    assert ascii_only(environment) is is_ascii


async def test_a_whole_screen_is_ascii():
    app = RigApp(Options(ascii=True), KEYS, FakeClient(DaemonState(0, QUIET)))
    app.driver.flow = Flow(Stage.DEVICE)
    async with app.run_test(size=(80, 24)) as pilot:
        while "DEVICE" not in text_of(app):
            await pilot.pause()
        assert text_of(app).isascii()
        assert "# STOP  F9 or Esc" in text_of(app)

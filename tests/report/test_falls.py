"""The picture of one fall shows what fell, not how its passages were taken together."""

import pytest

from rig.predictions import predict_incline
from rig.protocol import reader
from rig.report.falls import fall_figures
from sim.dials import Dials
from tests.analysis.drops import PROTOCOLS, UNIFORM, case
from tests.analysis.test_datum_board import BOARD_GRADED

AIR = reader.parse(f"{UNIFORM.text}drag: {{terminal_speed: 15 m/s}}\n")


@pytest.mark.parametrize("name", ["falling-ball", "glider", "picket-fence"])
def test_points_of_a_perfect_fall_lie_on_its_line(name):
    """A glider's card is in a beam for a third of a second, and speeds up meanwhile."""
    drop = case(reader.read(PROTOCOLS / f"{name}.yaml"), Dials.quiet(), run=1)
    (figure,) = fall_figures(drop.protocol, drop.drop, drop.scale.hz, drop.analyze())
    panels = [panel for panel in figure.panels if panel.y.label.startswith("residual")]
    assert [len(panel.series[-1].y) >= 4 for panel in panels] == [True, True]
    assert all(abs(ratio) < 0.2 for panel in panels for ratio in panel.series[-1].y)


@pytest.mark.parametrize(("protocol", "run"), [(AIR, 25), (BOARD_GRADED, 1)], ids=["air", "board"])
def test_points_of_a_perfect_separation_lie_on_the_models_line(protocol, run):
    """The line falls in the stated air, and heights count from where the top rod touches."""
    drop = case(protocol, Dials.quiet(), run=run)
    figure, speeds = fall_figures(drop.protocol, drop.drop, drop.scale.hz, drop.analyze())
    residuals = figure.panels[-1].series[-1].y
    assert len(residuals) > 100
    assert max(map(abs, residuals)) < 0.2
    free_fall, model, *_ = speeds.panels[0].series
    assert free_fall.y[-1] == model.y[-1] == 0.0
    stated = predict_incline(protocol, drop.run.incline_deg, "A")
    assert model.x[-1] == pytest.approx(stated.speed_m_s**2)
    assert free_fall.x[-1] == pytest.approx(stated.free_fall_speed_m_s**2)

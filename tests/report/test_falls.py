"""The picture of one fall shows what fell, not how its passages were taken together."""

import pytest

from rig.protocol import reader
from rig.report.falls import fall_figures
from sim.dials import Dials
from tests.analysis.drops import PROTOCOLS, case


@pytest.mark.parametrize("name", ["falling-ball", "glider", "picket-fence"])
def test_points_of_a_perfect_fall_lie_on_its_line(name):
    """A glider's card is in a beam for a third of a second, and speeds up meanwhile."""
    drop = case(reader.read(PROTOCOLS / f"{name}.yaml"), Dials.quiet(), run=1)
    (figure,) = fall_figures(drop.protocol, drop.drop, drop.scale.hz, drop.analyze())
    panels = [panel for panel in figure.panels if panel.y.label.startswith("residual")]
    assert [len(panel.series[-1].y) >= 4 for panel in panels] == [True, True]
    assert all(abs(ratio) < 0.2 for panel in panels for ratio in panel.series[-1].y)

"""Tables of effects and of scatter, for the page and the terminal."""

from __future__ import annotations

from rig.analysis.pairs import Effects
from rig.analysis.result import Measured
from rig.analysis.summary import Incline
from rig.report.parts import scatter_parts, tables


def test_effects_have_the_digits_that_they_deserve():
    one = Effects(
        42.5, "A", "B", 3,
        {"separation_m": Measured(1.234e-3, 0.05e-3), "speed_m_s": Measured(-4e-3, 3e-3)},
        {"release_skew_s": Measured(0.2e-3, 0.4e-3)},
    )  # fmt: skip
    (part,) = tables("effects", [one])
    assert part.heading.startswith("Differences: chain A − chain B")
    text = "\n".join(part.table)
    assert "\n       42.5 " in text
    assert "1.234 ± 0.098" in text
    assert "−4.0 ± 5.9" in text
    assert "0.20 ± 0.78" in text
    assert "Δz ± U (mm)" in text
    assert "skew ± U (ms)" in text.replace("sides' skew ± U (ms)", "skew ± U (ms)")
    assert not list(tables("effects", []))


def test_scatter_has_the_paper_s_bars():
    means = {"separation_m": Measured(0.115, 2e-4), "speed_m_s": Measured(6.9, 1e-3)}
    (part,) = scatter_parts([Incline(42.5, 4, means, {"separation_m": 8e-4}, {})])
    head, _, first, second = (row.split() for row in part.table)
    assert head[-5:] == ["SD", "SE", "u", "U95", "SD/2"]
    assert " ".join(first) == "42.5 4 Δz (mm) 115.000 0.800 0.400 0.200 0.392 0.400"
    assert second[-3:] == ["6900.00", "1.00", "1.96"]  # one run has no scatter

"""Tables of effects and of scatter, for the page and the terminal."""

from __future__ import annotations

from rig.report.columns import aligned
from rig.report.parts import effects_parts, scatter_part


def q(value: float, u: float) -> dict[str, float]:
    return {"value": value, "u": u, "U95": 2.0 * u}


def test_effects_have_the_digits_that_they_deserve():
    one = {
        "incline_deg": 42.5, "chains": ["A", "B"], "blocks": 3,
        "chain": {"separation_m": q(1.234e-3, 0.05e-3), "speed_m_s": q(-4e-3, 3e-3)},
        "side": {"release_skew_s": q(0.2e-3, 0.4e-3)},
    }  # fmt: skip
    (part,) = effects_parts({"effects": [one]})
    assert part.heading.startswith("Chain A less chain B")
    text = "\n".join(aligned(part.columns, part.records))
    assert "\n       42.5 " in text
    assert "1.23 ± 0.10" in text
    assert "−4.0 ± 6.0" in text
    assert "0.20 ± 0.80" in text
    assert "Δz ± U (mm)" in text
    assert "skew ± U (ms)" in text.replace("sides' skew ± U (ms)", "skew ± U (ms)")
    assert not list(effects_parts({"summary": []}))


def test_scatter_has_the_paper_s_bars():
    line = {
        "incline_deg": 42.5, "n": 4, "separation_m": q(0.115, 2e-4), "separation_sd_m": 8e-4,
        "separation_se_m": 4e-4, "speed_m_s": q(6.9, 1e-3),
    }  # fmt: skip
    part = scatter_part({"summary": [line]})
    head, _, first, second = (row.split() for row in aligned(part.columns, part.records))
    assert head[-5:] == ["SD", "SE", "u", "U95", "SD/2"]
    assert first == [
        "42.5",
        "4",
        "Δz",
        "(mm)",
        "115.000",
        "0.800",
        "0.400",
        "0.200",
        "0.400",
        "0.400",
    ]
    assert second[-3:] == ["6900.00", "1.00", "2.00"]  # one run has no scatter

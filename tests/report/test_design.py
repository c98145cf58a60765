"""What a layout of gates is said to tell."""

from rig.commands.design import design_lines


def test_uncertainties_are_plain_numbers():
    layout = {
        "gates": [{"side": "free", "height_m": 0.05}],
        "readable": True,
        "trials": {"drops": 20, "read": 20, "text": "of 20 trial drops 20 are read"},
        "measurands": [
            {"name": "speed_m_s", "u_run": 1.234},
            {"name": "gravity_m_s2", "u_run": 0.0256},
        ],
        "coefficients": [
            {"name": "friction", "u": 0.0000456, "identified": True},
            {"name": "alpha A", "u": 0.01, "identified": True},
        ],
    }
    lines = design_lines({"runs": 4, "scatter": "stated", "current": layout})
    assert [line.split()[-1] for line in lines[4:7]] == ["1234", "26", "0.000046"]
    assert "α of A" in "\n".join(lines)

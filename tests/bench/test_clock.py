"""``./run bench clock``, small: errors fall with time, and a reference beats them all."""

from pathlib import Path

from bench.clock import clock

FENCE = str(Path(__file__).parents[2] / "protocols" / "picket-fence.yaml")


def test_a_minute_is_enough_and_a_reference_is_better():
    rows = {(row.duration_s, row.source): row for row in clock(FENCE, 3, (10.0, 60.0))}
    assert set(rows) == {(10.0, "pings"), (60.0, "pings"), (60.0, "reference")}
    assert rows[60.0, "pings"].worst < 5.0
    assert rows[60.0, "pings"].rms < rows[10.0, "pings"].rms
    by_reference = rows[60.0, "reference"]
    assert 0.04 < by_reference.rms < 0.06, "that of the reference itself, 0.05 ppm"
    assert by_reference.held == 1.0

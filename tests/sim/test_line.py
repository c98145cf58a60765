"""Bad lines."""

from sim.line import BadLine


def test_a_busy_line_changes_only_what_goes_both_ways_at_once():
    line = BadLine(0.0, 0.0, 1.0, seed=1)
    data = bytes(range(100))
    assert line.transfer(data, b"") == (data, b"")
    assert line.transfer(b"", data) == (b"", data)
    changed = line.transfer(data, data)
    assert all(a != b for way in changed for a, b in zip(way, data, strict=True))

"""``rig run`` from beginning to end, and how it fails."""

import os
import re
from html import unescape

import pytest

from rig.analysis import drop as reading
from rig.session.store import Session
from tests.cli.lab import assert_whole, drops_of, log_of, rig, truth_of

MEASURED = ("separation_m", "separation_raw_m", "speed_m_s", "release_skew_s")


@pytest.fixture
def run(call, tmp_path, protocol):
    """Run the short protocol in this process on a session of the given name."""

    def run(name="s", *more, port="sim://", protocol=protocol, **ends):
        words = ("run", protocol, "--port", port, "--session", tmp_path / name)
        return call(*words, *more, **ends)

    return run


def test_a_protocol_is_carried_out_from_beginning_to_end(finished):
    code, out, err = finished.table
    assert code == 0, err
    stamp, headings, rule, *rows, clock = out.replace("\n\n", "\n").splitlines()
    assert stamp == "SIMULATED DATA"
    assert headings.split()[:2] == ["incline", "(°)"]
    assert set(rule) == {"─", " "}
    of_separation, of_speed, remarks = rows[:2], rows[4:6], rows[6:]
    for those in (of_separation, of_speed):
        assert [row.split()[:2] for row in those] == [["40", "2"], ["60", "2"]]
    assert remarks[0].startswith("Measured positions match the model to ")
    assert clock.startswith("Board clock: 13")
    told = [line for line in err.splitlines() if line.startswith("run ")]
    assert [line.split()[1] for line in told] == ["1/4", "2/4", "3/4", "4/4"]
    assert err.splitlines()[-1].startswith("4 runs, 4 drops: separation Δz at ")
    assert not re.search(r"(?m)^run ", out)
    assert_whole(finished.session, 4)


def test_a_drop_is_read_once(run, monkeypatch, fence):
    seen, identify = [], reading.identify
    monkeypatch.setattr(reading, "identify", lambda *given: seen.append(0) or identify(*given))
    run(protocol=fence)
    assert len(seen) == 2


def test_the_truth_is_apart_from_the_session(finished):
    truth = truth_of(finished.session)
    assert [(line["run"], line["attempt"]) for line in truth] == [(n, 1) for n in (1, 2, 3, 4)]
    stored = finished.session.read_bytes()
    for line in truth:
        for name in MEASURED:
            assert repr(line[name]).encode() not in stored


def test_three_voids_of_a_kind_end_it_with_code_3_and_still_json(run, call, tmp_path):
    done = run("s", "--json", port="sim://?skew_sd=1s", code=3)
    found = done.json
    assert [(r["run"], r["attempt"], r["verdict"]) for r in found["runs"]] == [(1, 3, "void")]
    assert all(r["reasons"] for r in found["runs"])
    assert [(r["run"], r["attempt"]) for r in found["superseded"]] == [(1, 1), (1, 2)]
    assert found["summary"] == []
    told = done.err.splitlines()
    assert len([line for line in told if line.startswith("run ")]) == 3
    at = next(n for n, line in enumerate(told) if line.startswith("stopped: "))
    assert "the last 3 drops are void for the same reason: " in told[at]
    assert told[at + 1].startswith("  hint: put that right at the rig")
    log = log_of(tmp_path / "s")
    again = run("s", port="sim://?skew_sd=1s", code=3)
    assert "stopped: the last 3 drops" in again.err
    assert log_of(tmp_path / "s")[1][: len(log[1])] == log[1]
    assert drops_of(tmp_path / "s")[:4] == [(1, 1), (1, 2), (1, 3), (1, 4)]
    assert "No accepted runs" in again.out
    call("report", tmp_path / "s", "-o", tmp_path / "r.html")
    what = again.out.splitlines()[again.out.splitlines().index("what to do:") + 1].strip()
    assert f"<td>{what}" in unescape((tmp_path / "r.html").read_text("utf-8"))


def test_a_line_that_loses_most_bytes_is_device_trouble_and_can_be_continued(
    run, call, tmp_path, fence
):
    done = run(port="sim://?lose=0.9", protocol=fence, code=4)
    assert "did not answer" in done.err
    assert done.out == ""
    call("analyze", tmp_path / "s")
    run(protocol=fence)
    assert_whole(tmp_path / "s", 2)
    run(protocol=fence)


def test_blocked_beams_that_nobody_clears_are_device_trouble(run, tmp_path):
    assert "hint: " in run(port="sim://?drop_error=12&seed=2", code=4).err
    assert log_of(tmp_path / "s") == {}, "nothing was armed"
    with Session.open(tmp_path / "s", readonly=True) as session:
        assert len(session.pings()) > 5, "somebody might have cleared them"


def test_whoever_is_there_is_asked_before_each_drop(tmp_path, fence):
    session = tmp_path / "s"
    args = ("run", fence, "--port", "sim://", "--session", session)
    ours, terminal = os.openpty()
    try:
        os.write(ours, b"\n\x04")  # Ctrl-D instead of a second answer
        done = rig(*args, stdin=terminal, code=130)
        assert all(f"run {number} of 2: put fence" in done.err for number in (1, 2))
        assert drops_of(session) == [(1, 1)]
        done = rig(*args, "--yes", stdin=terminal)
        assert "run 2 of 2: put fence" not in done.err
        assert done.out.startswith("SIMULATED DATA\n")
        assert_whole(session, 2)
    finally:
        os.close(ours)
        os.close(terminal)

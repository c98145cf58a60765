"""Exports of data loggers: what they look like, and every fault at its place."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from rig.errors import InputError
from rig.records import Drop
from rig.timers import signals
from rig.timers.crossings import find_crossings
from rig.timers.edge_rows import is_own
from rig.timers.layouts import FileReading, find_layouts
from rig.timers.lines import read_lines
from rig.timers.moments import TICK_HZ
from rig.timers.timer_file import TimerFile
from tests.examples import examples
from tests.tables import cases
from tests.timers.test_edges_csv import faults_of
from tests.timers.test_edges_csv import read as read_own

VERNIER = (
    "Vernier Format 2\nfence.cmbl\nRun 1\nTime\tGateState\tDistance\nT\tS\tD\ns\t\tm\n\n"
    "0.25\t1\t0\n0.26\t0\t\n0.275\t1\t0.05\n"
)


def drops_of(file, channels: dict[str, int], bars: int) -> list[Drop]:
    """Read a file in the most usual way, its inputs being as given."""
    file.stated["channels"] = channels
    layout = next(find_layouts(file, list(channels.values()), bars))
    reading = FileReading(file, layout)
    return list(map(reading.drop, reading.runs))


def read(tmp_path: Path, content: str | bytes, bars: int = 8) -> list[Drop]:
    path = tmp_path / "export.txt"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return drops_of(signals.read_file(TimerFile(path)), {"": 3}, bars)


def told(drop: Drop) -> list[tuple[float, bool]]:
    assert drop.tick_hz == TICK_HZ
    assert {edge.channel for edge in drop.edges} == {3}
    return [(edge.tick / TICK_HZ, edge.blocked) for edge in drop.edges]


@cases
def test_what_programs_write(tmp_path, text):
    (drop,) = read(tmp_path, text)
    assert told(drop) == [(0.25, True), (0.26, False), (0.275, True)]


@pytest.mark.parametrize(
    "text", ["0.25\n0.26\n0.275\n", "0,25\n0,26\n0,275\n", "Time (s)\n0.25\n0.26\n0.275\n"]
)
def test_a_column_of_times_is_of_darkening_or_of_both(tmp_path, text):
    """As many times as bars, or fewer: the beam darkened. More: darkened and cleared in turn."""
    (drop,) = read(tmp_path, text, bars=3)
    assert told(drop) == [(0.25, True), (0.26, True), (0.275, True)]
    (drop,) = read(tmp_path, text, bars=2)
    assert told(drop) == [(0.25, True), (0.26, False), (0.275, True)]


faults = partial(faults_of, read)


@cases
def test_faults_are_located(tmp_path, text, line, column, key):
    assert (line, column, key) in faults(tmp_path, text)


@cases
def test_own_files_are_told_from_others(tmp_path, text, ours):
    path = tmp_path / "f"
    path.write_text(text)
    assert is_own(read_lines(path)) is ours


SHAPES = st.sampled_from(["\t", ";", ","]), st.booleans(), st.integers(1, 4)


@examples(60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(*SHAPES, st.lists(st.integers(1, 10**7), min_size=2, max_size=20))
def test_what_is_written_is_read(tmp_path, separator, comma, runs, steps):
    """Any separator, decimals by comma or by point, any number of runs beside each other."""
    comma = comma and separator != ","
    heading = separator.join(
        f"Time (s) Run #{n}{separator}State Run #{n}" for n in range(1, runs + 1)
    )
    rows, time = [heading], 0
    for n, step in enumerate(steps):
        time += step
        text = f"{time / 1e6:.6f}".replace(".", "," if comma else ".")
        rows.append(separator.join([text, str((n + 1) % 2)] * runs))
    found = read(tmp_path, "\n".join(rows))
    assert len(found) == runs
    for drop in found:
        ticks = [edge.tick for edge in drop.edges]
        assert [b - a for a, b in pairwise(ticks)] == [step * 10**6 for step in steps[1:]]
        assert [edge.blocked for edge in drop.edges] == [n % 2 == 0 for n in range(len(steps))]


@examples(150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([(read, ""), (read_own, ""), (read_own, "run,channel,time_s,state\n")]),
    st.binary(max_size=120)
    | st.text(st.sampled_from('0123456789.,;\t\n"eE+-# TimeStaruns()'), max_size=120).map(
        str.encode
    ),
)
def test_any_file_is_read_or_refused_with_a_reason(tmp_path, reader, content):
    read, head = reader
    try:
        outcome = [drop.edges for drop in read(tmp_path, head.encode() + content)]
    except InputError as error:
        outcome = [str(error)]
    assert outcome
    assert all(outcome)


def test_stacked_runs_are_runs_of_their_own(tmp_path):
    lower = VERNIER.replace("Run 1", "Run 2").replace("0.25\t", "0.24\t")
    for text in (VERNIER + lower, VERNIER + "Run 2\n0.24\t1\n0.26\t0\n0.275\t1\n"):
        one, two = read(tmp_path, text)
        assert (one.run, two.run) == (1, 2)
        assert [time for time, _ in told(one)] == [0.25, 0.26, 0.275]
        assert [time for time, _ in told(two)] == [0.24, 0.26, 0.275]


@cases
def test_what_is_refused_is_refused_for_the_true_reason(tmp_path, text, code, reason):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert code in {problem.reason.code for problem in caught.value.problems}
    assert reason in str(caught.value)
    assert caught.value.hint


@cases
def test_tables_of_telephones_and_of_several_gates_beside_each_other(tmp_path, text, label, times):
    path = tmp_path / "table.csv"
    path.write_text(text, "utf-8")
    file = signals.read_file(TimerFile(path))
    changes, names = file.changes[~file.changes["first"]], [*file.names]
    assert {names[one] for one in changes["label"]} == {label}
    ticks = changes["tick"].tolist()
    origin = min(ticks) - round(times[0] * TICK_HZ)  # of a date it is far away
    assert [(tick - origin) / TICK_HZ for tick in ticks] == pytest.approx(times)
    said = [signals.STATES[state] for state in changes["state"]]
    in_turn = ["blocked", "clear"] * (len(times) // 2)
    assert said in ([""] * len(times), in_turn) or set(said) == {"high", "low"}


@pytest.mark.parametrize("content", ["time (s),state\n0.1,1\n0.2,0\n0.3,1\n",
    "$timescale 1 us $end\n$var wire 1 ! D0 $end\n$enddefinitions $end\n"
    "#0 0!\n#1 1!\n#2 0!\n#3 1!\n"])  # fmt: skip
def test_a_flicker_is_no_record_of_drops(tmp_path, monkeypatch, content):
    monkeypatch.setattr(signals, "MAX_EVENTS", 2)
    assert faults(tmp_path, content)


def test_of_a_dump_only_changes_of_unlisted_wires_are_refused(tmp_path):
    """Not numbers in a comment, nor real numbers, whatever their names; a vector has inputs."""
    path = tmp_path / "dump.vcd"
    head = (
        "$timescale 1 us $end\n$var wire 1 ! D0 $end\n$var wire 4 1a bus $end\n"
        "$var real 64 0 volts $end\n$enddefinitions $end\n$comment\n100\n$end\n"
    )
    path.write_text(f"{head}#0 0! b0101 1a\nr1.5 0\n#400 1!\n#500 0!\n", "utf-8")
    assert signals.read_file(TimerFile(path)).changes.size == 7
    assert faults(tmp_path, f"{head}#0 0!\n#400 1!\n#500 0!\n1a\n") == [(12, 1, "wire")]


def test_a_line_longer_than_any_text_s_is_refused_at_its_place(tmp_path):
    assert faults(tmp_path, "time (s),state\n0.1,1\n" + "1" * 20_001 + "\n") == [(3, 1, "")]


@pytest.mark.parametrize(
    ("end", "is_said"), [("0.647812", False), ("0.6478", True), ("0.6478\n", False), ("1", True)]
)
def test_a_number_that_may_be_cut_off_is_said(tmp_path, end, is_said):
    path = tmp_path / "export.txt"
    path.write_text(f"Time (s)\n0.251234\n0.262345\n0.473456\n{end}", "utf-8")
    notes = signals.read_file(TimerFile(path)).notes
    assert any(note.code == "last_line_cut" for note in notes) is is_said


@given(st.floats(0.0, 1.0), st.floats(1.0, 30.0), st.sampled_from([-5.0, 5.0]))
def test_ramps_of_volts_are_where_they_cross_the_middle(phase, slow, swing):
    times = phase + np.arange(400.0)
    ramps = 100.0 - slow, 100.0 + slow, 250.0 - slow, 250.0 + slow
    volts = np.interp(times, ramps, [0.0, swing, swing, 0.0])
    _, crossings = find_crossings(np.stack([times, times, volts], axis=1))
    assert crossings[:, 1] == pytest.approx([100.0, 250.0])
    assert crossings[:, 2].tolist() == [swing > 0.0, swing < 0.0]

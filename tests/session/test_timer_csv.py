"""Exports of data loggers: what they look like, and every fault at its place."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from rig.errors import InputError
from rig.records import Drop
from rig.session.edges_csv import TICK_HZ
from rig.session.timer_csv import read_timer
from rig.session.timer_table import is_logger_table
from tests.examples import examples

VERNIER = (
    "Vernier Format 2\nfence.cmbl\nRun 1\nTime\tGateState\tDistance\nT\tS\tD\ns\t\tm\n\n"
    "0.25\t1\t0\n0.26\t0\t\n0.275\t1\t0.05\n"
)
PASCO = (
    '"Time (s) Run #1";"State Run #1";"Time (s) Run #2";"State Run #2"\n'
    "0,25;1;1,5;1\n0,26;0;1,51;0\n0,275;1;;\n"
)


def read(tmp_path: Path, content: str | bytes, bars: int = 8) -> list[Drop]:
    path = tmp_path / "export.txt"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_timer(path, 3, bars)


def told(drop: Drop) -> list[tuple[float, bool]]:
    assert drop.tick_hz == TICK_HZ
    assert all(edge.channel == 3 for edge in drop.edges)
    return [(edge.tick / TICK_HZ, edge.blocked) for edge in drop.edges]


def test_a_vernier_table(tmp_path):
    (drop,) = read(tmp_path, VERNIER)
    assert told(drop) == [(0.25, True), (0.26, False), (0.275, True)]
    assert (drop.run, drop.attempt, drop.certificate) == (1, 1, None)


def test_a_pasco_table_with_decimal_commas_and_two_runs(tmp_path):
    first, second = read(tmp_path, PASCO)
    assert told(first) == [(0.25, True), (0.26, False), (0.275, True)]
    assert told(second) == [(0.5, True), (0.51, False)]
    assert (first.run, second.run) == (1, 2)


@pytest.mark.parametrize(
    "text",
    [
        "0.25,1\n0.26,0\n0.275,1\n",
        "0.25\t1\n0.26\t0\n0.275\t1\n",
        "0,25;1\n0,26;0\n0,275;1\n",
        "Time (ms),Blocked?\n250,Blocked\n260,Unblocked\n275,Blocked\n",
        "\ufeffLatest: Time (s),Latest: GateState\r\n0.25,1\r\n0.26,0\r\n0.275,1\r\n",
        "State,Time (s)\n1,0.25\n0,0.26\n1,0.275\n",
        '"Zeit t (s)";"Zustand"\n"0,25";"1"\n"0,26";"0"\n"0,275";"1"\n',
        "Time\tState\ns\t\n0.25\t1.0\n0.26\t0.0\n0.275\t1.0\n",
        "t (µs);state\n250000;1\n260000;0\n2,75e5;1\n",
    ],
)
def test_what_programs_write(tmp_path, text):
    (drop,) = read(tmp_path, text)
    assert told(drop) == [(0.25, True), (0.26, False), (0.275, True)]


def test_utf_16_as_some_programs_on_windows_write_it(tmp_path):
    (drop,) = read(tmp_path, PASCO.replace("Run #2", "Run #1").encode("utf-16"))[:1]
    assert told(drop)[0] == (0.25, True)


@pytest.mark.parametrize(
    "text", ["0.25\n0.26\n0.275\n", "0,25\n0,26\n0,275\n", "Time (s)\n0.25\n0.26\n0.275\n"]
)
def test_a_column_of_times_is_of_darkening_or_of_both(tmp_path, text):
    """As many times as bars, or fewer: the beam darkened. More: darkened and cleared in turn."""
    (drop,) = read(tmp_path, text, bars=3)
    assert told(drop) == [(0.25, True), (0.26, True), (0.275, True)]
    (drop,) = read(tmp_path, text, bars=2)
    assert told(drop) == [(0.25, True), (0.26, False), (0.275, True)]


def faults(tmp_path: Path, content: str) -> list[tuple[int, int, str]]:
    with pytest.raises(InputError) as caught:
        read(tmp_path, content)
    assert caught.value.exit_code == 2
    return [(one.line, one.column, one.key) for one in caught.value.problems]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("Time,State\n0.1,1\n0.2,maybe\n", (3, 5, "state")),
        ("Time,State\n0.1,1\nx,0\n", (3, 1, "time")),
        ("Time,State\n0.1,x\n0.2,0\n", (2, 5, "state")),
        ("0.1,x\n0.2,0\n", (1, 5, "state")),
        ("Time,State\n0.2,1\n0.1,0\n", (3, 1, "time")),
        ("Time,State\n0.2,1\n  1e9 ,0\n", (3, 3, "time")),
        ("Time,State\n0.2,1\n0.3\n", (3, 1, "state")),
        ("Time (fortnights),State\n0.2,1\n", (1, 1, "time")),
        ("Distance,State\n0.2,1\n", (1, 1, "")),
        ("1,2,3\n", (1, 5, "")),
        ("", (1, 1, "")),
        ("nothing here\n", (1, 1, "")),
        ("Time;State\n0,1;1\n0,2;0\n0,3,4;1\n", (4, 1, "time")),
    ],
)
def test_faults_are_located(tmp_path, text, place):
    assert place in faults(tmp_path, text)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        read_timer(tmp_path / "none", 0, 8)


def test_own_files_are_told_from_others(tmp_path):
    path = tmp_path / "f"
    for text, theirs in [
        ("run,channel,time_s,state\n", False),
        ("# remark\n Run , channel,time_s, state\n", False),
        ("run,channel,time,state\n1,0,0.1,1\n", False),
        ("time,voltage\n0,1\n", False),
        ("", False),
        ("one\ntwo\n", False),
        (VERNIER, True),
        (PASCO, True),
        ("Time (s),Position (m)\n0.1,0\n", True),
        ("0.1\n", True),
        ("0.1,1\n", True),
    ]:
        path.write_text(text)
        assert is_logger_table(path) is theirs, text


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
    st.one_of(
        st.binary(max_size=120),
        st.text(st.sampled_from('0123456789.,;\t\n"eE+-# TimeStaruns()'), max_size=120).map(
            str.encode
        ),
    )
)
def test_any_file_is_read_or_refused_with_a_reason(tmp_path, content):
    try:
        drops = read(tmp_path, content)
    except InputError as error:
        drops = []
        refused = str(error)
    assert all(drop.edges for drop in drops)
    assert drops or refused

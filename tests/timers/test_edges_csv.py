"""Edges as CSV: exact there and back, and every fault at its place."""

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import InputError
from rig.records import Drop, Edge
from rig.timers import lines
from rig.timers.edge_rows import edges_text, read_edges
from rig.timers.moments import TICK_HZ
from tests.tables import cases

HEADER = "run,channel,time_s,state\n"


def read(tmp_path: Path, content: str | bytes) -> list[Drop]:
    path = tmp_path / "events.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_edges(path)


def faults_of(
    read: Callable[..., object], tmp_path: Path, content: str | bytes
) -> list[tuple[int, int, str]]:
    """Where a file is refused, and of what."""
    with pytest.raises(InputError) as caught:
        read(tmp_path, content)
    assert caught.value.exit_code == 2
    for problem in caught.value.problems:
        assert problem.message == problem.reason.text
    return [(problem.line, problem.column, problem.key) for problem in caught.value.problems]


faults = partial(faults_of, read)


def test_times_are_exact(tmp_path: Path) -> None:
    [drop] = read(
        tmp_path,
        HEADER + "3,0,1700000000.100000000001,1\n3,1,1700000001.2,1\n3,0,17000000013e-1,0\n",
    )
    assert drop.tick_hz == TICK_HZ
    assert [edge.tick for edge in drop.edges] == [
        100_000_000_001,
        1_200_000_000_000,
        1_300_000_000_000,
    ]
    assert (drop.run, drop.attempt, drop.fire_tick, drop.certificate) == (3, 1, None, None)


def test_what_people_and_programs_write(tmp_path: Path) -> None:
    head = "\ufeff# from my timer\r\n\r\n Run , channel,time_s, state\r\n"
    text = head + '1, 2 ,-0.25,"1"\r\n#\r\n 1,2, .5 ,0'
    [drop] = read(tmp_path, text)
    assert drop.edges == (Edge(750_000_000_000, 2, True), Edge(1_500_000_000_000, 2, False))
    assert drop.initial_state == 0


def test_channels_one_after_another_are_merged_stably(tmp_path: Path) -> None:
    rows = "1,5,0.2,1\n1,5,0.4,0\n2,0,9.5,0\n1,3,0.1,0\n1,3,0.2,1\n"
    first, second = read(tmp_path, HEADER + rows)
    assert [(edge.channel, edge.tick // 10**11) for edge in first.edges] == [
        (3, 1),
        (5, 2),
        (3, 2),
        (5, 4),
    ]
    assert first.initial_state == 1 << 3
    assert second.edges == (Edge(5 * 10**11, 0, False),)


@cases
def test_faults_of_a_row_are_located(tmp_path: Path, row: str, column: int, key: str) -> None:
    assert faults(tmp_path, f"{HEADER}# note\n1,7,1,1\n{row}\n") == [(4, column, key)]


def test_a_fault_has_a_code_with_values(tmp_path: Path) -> None:
    path = tmp_path / "events.csv"
    path.write_text(HEADER + "1,3,0.2,1\n1,3,0.1,1\n0,99,0.1,1\n")
    with pytest.raises(InputError) as caught:
        read_edges(path)
    early, run, channel = caught.value.problems
    assert (run.line, run.column, run.key) == (4, 1, "run")
    assert early.reason.json() == {
        "code": "not_accepted",
        "values": {
            "text": "0.1",
            "accepted": "a time from 0.2 s (the last of channel 3) to 3600.2 s",
        },
    }
    assert str(channel) == f"{path}:4:3: channel: '99' is not a channel: 0 to 15"


def test_many_faults_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "events.csv"
    path.write_text(HEADER + "1,0,nan,1\n" * 80)
    with pytest.raises(InputError) as caught:
        read_edges(path)
    assert len(caught.value.problems) == 50
    assert str(caught.value).splitlines()[-1] == f"{path}: and 30 more problems"
    assert str(caught.value).startswith(f"{path}:2:5: time_s: ")


@pytest.mark.parametrize(
    "content",
    [
        "",
        "# only a note\n",
        HEADER,
        "1,0,0.1,1\n",
        HEADER.encode("utf-16"),
        b"\xff\xfe\x00" * 100,
        "SQLite format 3\x00" + "\x00" * 100,
    ],
)
def test_other_files(tmp_path: Path, content: str | bytes) -> None:
    assert faults(tmp_path, content)


def test_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lines, "MAX_BYTES", 10)
    assert faults(tmp_path, HEADER + "1,0,0,1\n") == [(1, 1, "")]


@pytest.mark.parametrize("name", ["", "missing.csv"])
def test_unreadable(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="cannot read"):
        read_edges(tmp_path / name)


def test_fire_stamped_drops_use_the_calibrated_rate(tmp_path: Path) -> None:
    path = tmp_path / "edges.csv"
    drop = Drop(run=4, attempt=2, tick_hz=2_000_000, edges=(Edge(1_000_000, 0, True),), fire_tick=7)
    path.write_text(edges_text([drop], lambda _: 1_999_000.5), "utf-8")
    time = Fraction(path.read_text().splitlines()[1].split(",")[2])
    assert abs(time - Fraction(1_000_000) / Fraction(1_999_000.5)) < Fraction(1, 10**12)
    with pytest.raises(ValueError, match="two drops"):
        edges_text([drop, drop], lambda _: 1)


@st.composite
def imported_drops(draw: st.DrawFn) -> list[Drop]:
    drops = []
    for run in sorted(draw(st.sets(st.integers(1, 10**9 - 1), min_size=1, max_size=4))):
        ticks = sorted(draw(st.lists(st.integers(0, 3599 * 10**12), min_size=1, max_size=12)))
        shift = ticks[0] // TICK_HZ * TICK_HZ
        edges = [
            Edge(tick - shift, draw(st.integers(0, 15)), draw(st.booleans())) for tick in ticks
        ]
        first = {edge.channel: edge.blocked for edge in reversed(edges)}
        mask = sum(1 << channel for channel, blocked in first.items() if not blocked)
        drops.append(
            Drop(run=run, attempt=1, tick_hz=TICK_HZ, edges=tuple(edges), initial_state=mask)
        )
    return drops


@given(imported_drops())
def test_round_trip(tmp_path_factory: pytest.TempPathFactory, drops: list[Drop]) -> None:
    path = tmp_path_factory.mktemp("round") / "edges.csv"
    path.write_text(edges_text(drops, lambda _: TICK_HZ), "utf-8")
    assert read_edges(path) == drops

"""What a terminal is shown that a pipe is not: Fig. 3 as it grows, colours, broken sentences."""

import io
import re

import pytest

from rig.analysis.result import Audit, DropResult, Measured
from rig.commands import output
from rig.commands.growing import Growing
from rig.protocol import reader
from rig.protocol.plan import runs
from rig.reasons import plain_reason
from tests.cli.lab import Terminal, short


@pytest.fixture
def size(monkeypatch):
    def of(columns: int, rows: int) -> None:
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setenv("LINES", str(rows))

    of(80, 24)
    return of


def dropped(run, verdict="accepted", *reasons):
    found = {"separation_m": Measured(0.115, 0.001), "speed_m_s": Measured(6.93, 0.01)}
    why = tuple(map(plain_reason, reasons))
    return DropResult(run, 1, verdict, why, Audit(4, 4, 0, 0, 0), found)


def screen(written: str) -> list[str]:
    """What a terminal shows in the end, which goes up, back and erases below."""
    lines = [""]
    row = 0
    for part in re.split(r"(\x1b\[\d+A\r\x1b\[J|\n)", re.sub(r"\x1b\[\d*m", "", written)):
        if up := re.match(r"\x1b\[(\d+)A", part):
            row -= int(up[1])
            lines = lines[: row + 1]
            lines[row] = ""
        elif part == "\n":
            row += 1
            lines += [""] * (row + 1 - len(lines))
        else:
            lines[row] += part
    return lines


def test_a_picture_is_drawn_over_and_what_is_odd_stays(size):
    protocol = reader.parse(short("[40 deg, 60 deg]", 2))
    planned = runs(protocol)
    terminal = Terminal()
    growing = Growing(protocol, terminal)
    growing.say("the rig is ready")
    heights = []
    for run in planned[:3]:
        growing.show_result(dropped(run), len(planned))
        heights.append(len(screen(terminal.getvalue())))
    assert len(set(heights)) == 1
    growing.show_result(dropped(planned[3], "void", "release skew -5.10 ms"), len(planned))
    lines = screen(terminal.getvalue())
    assert lines[0] == "the rig is ready"
    assert lines[1].startswith("run 4/4")
    assert lines[1].endswith("void: release skew −5.10 ms")
    assert sum("Δz" in line for line in lines) == 3  # the axis, the void drop, the last good one
    assert len(lines) <= 24
    assert max(map(len, lines[2:])) <= 80
    assert any(0x2800 < ord(letter) < 0x2900 for line in lines for letter in line)


def test_a_tall_terminal_shows_the_speed_too(size):
    size(120, 40)
    protocol = reader.parse(short("[40 deg]", 1))
    terminal = Terminal()
    Growing(protocol, terminal).show_result(dropped(runs(protocol)[0]), 1)
    assert "V (m/s)" in terminal.getvalue()


def test_colours_and_broken_sentences_are_for_terminals(size, monkeypatch):
    lines = ["  a   table's line that is longer than the terminal is wide  " + "x" * 40,
             "run 3 is void: " + "why " * 30]  # fmt: skip
    for kind in (io.StringIO, Terminal):
        shown = kind()
        monkeypatch.setattr("sys.stdout", shown)
        output.show(lines)
        told = shown.getvalue().splitlines()
        if kind is Terminal:
            assert told[0] == lines[0]
            assert "\x1b[33mvoid\x1b[0m" in told[1]
            assert all(len(line) <= 80 for line in told[2:])
            assert len(told) > 2
        else:
            assert told == lines
    monkeypatch.setenv("NO_COLOR", "1")
    assert output.tint("void") == "void"

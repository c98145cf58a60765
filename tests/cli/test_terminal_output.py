"""What a terminal is shown that a pipe is not: colours, broken sentences."""

import io

import pytest

from rig.commands import output


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def size(monkeypatch):
    def of(columns: int, rows: int) -> None:
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setenv("LINES", str(rows))

    of(80, 24)
    return of


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

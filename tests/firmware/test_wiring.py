"""What firmware/README.md and its pictures say about pins is what `board.h` says."""

import re

import pytest

from firmware.pictures import BOARDS, draw
from firmware.pins import read_pins
from rig.flash.boards import TARGETS
from tests.firmware.toolchain import FIRMWARE
from tests.tables import read_table

README = (FIRMWARE / "README.md").read_text(encoding="utf-8")
WORDS = read_table(__file__, "pins")["words"]
MAPS = read_table(__file__, "pins")
EACH = pytest.mark.parametrize("board", BOARDS)


def rows(board: str) -> list[tuple[str, ...]]:
    """Return the rows of a board's table."""
    _, _, section = README.partition(f"\n### {read_pins(board).board}\n")
    section = section.partition("\n#")[0]
    return [
        tuple(cell.strip() for cell in line.strip("|").split("|"))
        for line in section.splitlines()
        if re.match(r"\| (?!gate)[^-]", line)
    ]


@EACH
def test_the_table_has_the_pins_of_the_board(board):
    pins = read_pins(board)
    gates = [(str(n), pin, MAPS[board][pin]) for n, pin in enumerate(pins.gates)]
    others = [(WORDS[name], pin, port) for name, (pin, port) in pins.others.items()]
    assert all(MAPS[board][pin] == port for _, pin, port in others)
    columns = 3 if board == "rp2040" else 2  # ports of an AVR are nobody's business
    assert sorted(rows(board)) == sorted(row[:columns] for row in gates + others)


@EACH
def test_the_gates_are_as_many_as_the_firmware_says(board):
    text = (FIRMWARE / board / "board.h").read_text()
    said = int(re.search(r"#define BOARD_GATES (\d+)", text)[1])
    assert len(read_pins(board).gates) == said
    assert read_pins(board).board in {target.board.name for target in TARGETS.values()}


@EACH
def test_the_picture_is_up_to_date(board, tmp_path):
    draw(read_pins(board), tmp_path / "it.svg")
    now = (tmp_path / "it.svg").read_bytes()
    assert now == (FIRMWARE / board / "wiring.svg").read_bytes(), "python firmware/pictures.py"

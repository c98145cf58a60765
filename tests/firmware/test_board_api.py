"""What a board must bring is said in one header, and what is missing is named by the compiler."""

import re
import subprocess

import pytest

from tests.firmware.toolchain import FIRMWARE, need

HOST = (FIRMWARE / "host" / "board.h").read_text()
API = (FIRMWARE / "core" / "board_api.h").read_text()


def compiled(folder, board: str) -> subprocess.CompletedProcess[str]:
    need("gcc")
    (folder / "board.h").write_text(board)
    (folder / "it.c").write_text('#include "board_api.h"\n')
    return subprocess.run(
        ["gcc", "-std=gnu11", "-fsyntax-only", "-I.", f"-I{FIRMWARE / 'core'}", "it.c"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("there", "instead", "named"),
    [
        ("#define BOARD_LATE 256\n", "", "BOARD_LATE"),
        ("uint16_t board_gates(void);\n", "", "board_gates"),
        ("void board_led(bool on);", "void board_led(void);", "void board_led(bool on)"),
        ('"host"', '"a board of so many letters"', "board_type"),
        ("16000000u", "16000001u", "BOARD_HZ"),
    ],
)
def test_what_a_board_lacks_is_named(tmp_path, there, instead, named):
    assert compiled(tmp_path, HOST).returncode == 0
    done = compiled(tmp_path, HOST.replace(there, instead))
    assert done.returncode
    assert named in done.stderr


def test_the_core_asks_for_nothing_else():
    """The one place where `board.h` is included, and every word of a board's that the core uses."""
    words = set()
    for source in sorted((FIRMWARE / "core").glob("*.[ch]")):
        if source.name != "board_api.h":
            assert '"board.h"' not in source.read_text(), source
            words |= set(re.findall(r"\b(?:board|BOARD)_\w+", source.read_text()))
    assert words - {"board_api"} <= set(re.findall(r"\b(?:board|BOARD)_\w+", API))

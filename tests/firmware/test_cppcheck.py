"""cppcheck finds nothing in the firmware, as each board compiles it."""

import subprocess

import pytest

from tests.firmware.toolchain import FIRMWARE, need

# The compiler's own headers stay out: what the tool knows of an 8-bit AVR and its library is in
# its platform and library files.
AVR = ["--platform=avr8", "--library=avr", "-D__GNUC__", "-DF_CPU=16000000UL", "-DBAUD=500000"]
BOARDS = {
    "atmega2560": [*AVR, "-D__AVR_ATmega2560__", "-Iavr", "avr", "atmega2560"],
    "atmega328p": [*AVR, "-D__AVR_ATmega328P__", "-Iavr", "avr", "atmega328p"],
    "rp2040": ["--platform=unix32", "-Ipico", "pico", "rp2040"],
    "rp2350": ["--platform=unix32", "-Ipico", "pico", "rp2350"],
    "host": ["--platform=unix64", "-DBOARD_STREAMS=1", "host"],
}


def cppcheck(board: str, *more: object) -> subprocess.CompletedProcess[str]:
    need("cppcheck")
    return subprocess.run(
        [
            "cppcheck",
            "--quiet",
            "--std=c11",
            "--enable=warning,performance,portability",
            "--error-exitcode=1",
            '-DFIRMWARE_VERSION="0"',
            "-Icore",
            f"-I{board}",
            "core",
            *BOARDS[board],
            *map(str, more),
        ],
        cwd=FIRMWARE,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("board", BOARDS)
def test_nothing_is_found(board):
    done = cppcheck(board)
    assert done.returncode == 0, done.stdout + done.stderr

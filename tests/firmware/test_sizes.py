"""Flash, memory and stack of both boards stay within bounds, and the bound on the stack holds."""

from __future__ import annotations

import subprocess

import pytest

from firmware.size import measure
from rig.flash.boards import TARGETS
from tests.firmware.toolchain import FIRMWARE, make, need

BOARDS = {"mega": "atmega2560", "uno": "atmega328p"}
SPARE = 64
"""Bytes of stack that must stay unused in the worst case."""


@pytest.mark.parametrize("board", BOARDS)
def test_a_board_has_room(board):
    need("avr-objdump", "avr-nm", "avr-size")
    make("all")
    found = measure(FIRMWARE / "build" / BOARDS[board])
    assert found.stack + SPARE <= found.room, found
    assert found.flash <= TARGETS[board].flash_limit, found
    # A chain of calls that is not found would make the bound too low.
    assert found.path[:2] == ("main", "device_pass"), found
    assert found.path[-1].startswith("__vector_"), found


PROGRAM = """
#include <avr/interrupt.h>
int deep(int n) { RECURSION char a[40]; __asm__ volatile("" :: "r"(a) : "memory"); return n; }
int (*volatile pointer)(int) = deep;
ISR(TIMER0_OVF_vect) { __asm__ volatile("push r2\\n push r3\\n pop r3\\n pop r2"); }
int main(void) { return pointer(1) + 1; }
"""


@pytest.fixture
def program(tmp_path):
    need("avr-gcc", "avr-objdump")

    def build(recursion: str = ""):
        (tmp_path / "it.c").write_text(PROGRAM.replace("RECURSION", recursion))
        options = ["-mmcu=atmega328p", "-O1", "-ffunction-sections", "-fstack-usage"]
        for step in (["-c", "it.c", "-o", "it.o"], ["it.o", "-o", "firmware.elf"]):
            subprocess.run(["avr-gcc", *options, *step], cwd=tmp_path, check=True)
        return tmp_path

    return build


def test_the_bound_follows_pointers_and_counts_the_interrupt(program):
    found = measure(program())
    assert found.path == ("main", "deep", "__vector_16")
    # Return addresses: 3 × 2; the array: 40, with the frame pointer's 2; the interrupt saves SREG
    # and two registers. The pushes that only assembly shows are not in the compiler's account.
    assert 6 + 42 + 3 <= found.stack <= 6 + 42 + 3 + 6, found

"""Programs for the emulator, compiled when a test asks for them."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.firmware.toolchain import FIRMWARE, need

STRICT = ("-std=gnu11", "-Wall", "-Wextra", "-Wshadow", "-Werror")


@pytest.fixture(scope="session")
def compiled(tmp_path_factory) -> Callable[..., Path]:
    """Compile ``compiled("tests/talk.c", "atmega2560", "-DUBRR=16")``: file, controller, flags."""
    need("avr-gcc")
    folder = tmp_path_factory.mktemp("programs")
    done: dict[tuple[str, ...], Path] = {}

    def compile_once(source: str, mcu: str, *flags: str) -> Path:
        key = (source, mcu, *flags)
        if key not in done:
            out = folder / f"{len(done)}.elf"
            command = ["avr-gcc", *STRICT, "-Os", "-DF_CPU=16000000UL", f"-mmcu={mcu}", *flags]
            subprocess.run(
                [*command, str(FIRMWARE / "emulator" / source), "-o", str(out)], check=True
            )
            done[key] = out
        return done[key]

    return compile_once

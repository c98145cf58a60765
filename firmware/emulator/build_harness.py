# SPDX-License-Identifier: GPL-3.0-or-later
"""How the harness becomes the module `rig_emulator._harness`."""

from pathlib import Path

from cffi import FFI

HEADER = Path(__file__).parent / "rig_emulator" / "harness.h"

ffi = FFI()
ffi.cdef(
    "\n".join(line for line in HEADER.read_text("ascii").splitlines() if not line.startswith("#"))
)
ffi.set_source(
    "rig_emulator._harness",
    '#include "harness.h"',
    sources=[
        f"rig_emulator/{name}.c"
        for name in ("harness", "interrupts", "pins", "compare", "line", "queue")
    ],
    include_dirs=["rig_emulator", "/usr/include/simavr", "/usr/local/include/simavr"],
    libraries=["simavr"],
    extra_compile_args=["-O2", "-std=gnu11"],
)

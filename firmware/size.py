"""What a built firmware needs: flash, memory, and the most stack that can ever be in use.

The compiler's `.su` files say how much stack a function of C takes; the disassembly says who calls
whom, and what a function of assembly pushes. The worst chain of calls from `main`, plus the
costliest interrupt on top of it (they do not nest), bounds the stack: no run can exceed it, as long
as nothing recurses and no frame is dynamic, which is checked.
"""

from __future__ import annotations

import re
import subprocess
import sys
from bisect import bisect_right
from dataclasses import dataclass, field
from pathlib import Path

_RAM, _EEPROM = 0x800000, 0x810000  # where the linker puts the address spaces
_LABEL = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
_LINE = re.compile(r"^\s*([0-9a-f]+):\t[0-9a-f ]+\t(\S+)(.*)$")
_TARGET = re.compile(r".*0x([0-9a-f]+) <")
_POINTER = re.compile(r"R_AVR_(?:16_PM|\w+_GS)\s+\.text\.(\w+)")
_RETURNS = {"ret", "reti"}
_JUMPS = {"jmp", "rjmp"}
_CALLS = {"call", "rcall"}
_INDIRECT = {"icall", "eicall", "ijmp", "eijmp"}


@dataclass
class _Function:
    """What the disassembly shows of one function."""

    pushes: int = 0
    calls: set[str] = field(default_factory=set)
    jumps: set[str] = field(default_factory=set)
    indirect: bool = False


@dataclass(frozen=True, slots=True)
class Size:
    """What a firmware needs, in bytes.

    Attributes
    ----------
    flash
        Code, and the values variables start with.
    static
        Variables of all kinds.
    room
        Memory between the last variable and the top of the RAM.
    stack
        The most of it that can be in use.
    path
        The chain of calls that needs so much, with the interrupt on top of it.
    """

    flash: int
    static: int
    room: int
    stack: int
    path: tuple[str, ...]


def measure(build: Path) -> Size:
    """Measure what was built.

    Parameters
    ----------
    build
        Folder with `firmware.elf`, its `.o` and its `.su` files.

    Returns
    -------
    Size
        Its needs.

    Raises
    ------
    ValueError
        The stack has no bound.
    """
    elf = build / "firmware.elf"
    sections = _sections(elf)
    in_ram = [(at, size) for at, size in sections.values() if _RAM <= at < _EEPROM]
    flash = sections[".text"][1] + sections[".data"][1]
    top = _symbol(elf, "__stack") + 1
    stack, path = _worst(elf, build)
    return Size(
        flash,
        sum(size for _, size in in_ram),
        top - (max(at + size for at, size in in_ram) - _RAM),
        stack,
        path,
    )


def _tool(name: str, *arguments: str | Path) -> str:
    done = subprocess.run([f"avr-{name}", *arguments], capture_output=True, text=True, check=True)
    return done.stdout


def _sections(elf: Path) -> dict[str, tuple[int, int]]:
    """Address and size by name."""
    rows = (line.split() for line in _tool("size", "-A", elf).splitlines())
    return {row[0]: (int(row[2]), int(row[1])) for row in rows if row and row[0][0] == "."}


def _symbol(elf: Path, name: str) -> int:
    for line in _tool("nm", elf).splitlines():
        value, _, found = line.split(maxsplit=2)
        if found == name:
            return int(value, 16)
    raise ValueError(f"{elf} has no {name}")


def _frames(build: Path) -> dict[str, int]:
    """What each function of C takes, its return address included."""
    frames = {}
    for file in build.glob("*.su"):
        for line in file.read_text().splitlines():
            where, size, kind = line.split("\t")
            if kind != "static":
                raise ValueError(f"the frame of {where} is {kind}")
            frames[where.rpartition(":")[2]] = int(size)
    return frames


def _functions(elf: Path, entries: set[str]) -> dict[str, _Function]:
    """Read the disassembly. A label that nobody calls is a place inside the function before it."""
    text = _tool("objdump", "-d", elf).splitlines()
    lines = [(int(m[1], 16), m[2], _target(m[3])) for m in map(_LINE.match, text) if m]
    labels = {int(m[1], 16): m[2] for m in map(_LABEL.match, text) if m}
    called = {target for _, mnemonic, target in lines if mnemonic in _CALLS}
    starts = sorted(
        at
        for at, name in labels.items()
        if at in called or name in entries or name.startswith("__vector_") or at == min(labels)
    )
    names = [labels[at] for at in starts]

    def inside(at: int) -> str:
        return names[bisect_right(starts, at) - 1]

    functions = {name: _Function() for name in names}
    for number, (at, mnemonic, target) in enumerate(lines):
        function = functions[inside(at)]
        function.pushes += mnemonic == "push"
        function.indirect |= mnemonic in _INDIRECT
        if mnemonic in _CALLS and target is not None and target in starts:
            # Any other, as in `rcall .+0`, calls nobody: it is the shortest way to make a frame.
            function.calls.add(inside(target))
        elif target is not None and (mnemonic in _JUMPS or mnemonic.startswith("br")):
            function.jumps.add(inside(target))
        if number + 1 < len(lines) and mnemonic not in _RETURNS | _JUMPS:
            function.jumps.add(inside(lines[number + 1][0]))  # it runs on
    for name, function in functions.items():
        function.jumps.discard(name)
    return functions


def _target(operands: str) -> int | None:
    """Address an instruction names."""
    found = _TARGET.match(operands)
    return int(found[1], 16) if found else None


def _worst(elf: Path, build: Path) -> tuple[int, tuple[str, ...]]:
    frames = _frames(build)
    relocations = [_tool("objdump", "-r", file) for file in build.glob("*.o")]
    pointed = {name for text in relocations for name in _POINTER.findall(text)}
    functions = _functions(elf, {"main", *frames, *pointed})
    # A chip with more than 128 KB of flash keeps three bytes of each return address.
    address = 3 if "avr:6" in _tool("objdump", "-f", elf) else 2
    known: dict[str, tuple[int, tuple[str, ...]]] = {}

    def need(name: str, above: tuple[str, ...] = ()) -> tuple[int, tuple[str, ...]]:
        if name in above:
            raise ValueError(f"{name} calls itself: {' > '.join(above)}")
        if name not in known:
            function = functions[name]
            own = frames.get(name, function.pushes + address)
            targets = function.calls | function.jumps | (pointed if function.indirect else set())
            most = max((need(t, (*above, name)) for t in sorted(targets)), default=(0, ()))
            known[name] = (own + most[0], (name, *most[1]))
        return known[name]

    main = need("main")
    interrupts = [need(name) for name in functions if name.startswith("__vector_")]
    interrupt = max(interrupts, default=(0, ()))
    return main[0] + interrupt[0], main[1] + interrupt[1]


def main() -> None:
    """Print it."""
    build = Path(sys.argv[1])
    size = measure(build)
    print(f"{build.name}")
    print(f"  flash   {size.flash:6} bytes")
    print(f"  memory  {size.static:6} bytes of variables, {size.room} left for the stack")
    print(f"  stack   {size.stack:6} bytes at most, {size.room - size.stack} never used")
    print(f"          {' > '.join(size.path)}")


if __name__ == "__main__":
    main()

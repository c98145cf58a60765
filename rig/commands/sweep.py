"""``rig sweep``."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from rig.commands.output import say
from rig.errors import InputError
from rig.files import check_place, replacing
from rig.protocol import reader
from rig.report.canvas import KINDS
from rig.sweep.compute import NO_ANSWER, PILE, Swept, chunk_length, compute
from rig.sweep.executor import executor
from rig.sweep.layout import Layout, lay_out
from rig.sweep.tables import provenance, write_csv, write_npz

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable

    from rig.protocol.protocol import Protocol

INTERRUPTED = 130
_KINDS = (".csv", ".npz", *(f".{kind}" for kind in KINDS))


def main(arguments: Namespace) -> int:
    """Compute a sweep and write it to a file."""
    output = Path(arguments.output)
    _check_output(output)
    protocol = reader.read(arguments.protocol)
    layout = lay_out(protocol, arguments.vary)
    if _drawn(output):
        _check_drawable(layout)
    try:
        swept = _computed(layout, arguments.jobs, arguments.cluster)
        _write(output, protocol, layout, swept)
    except KeyboardInterrupt:
        say("rig: interrupted; nothing was written")
        return INTERRUPTED
    say(f"{output}: {_summary(swept)}")
    return 0


def _computed(layout: Layout, jobs: int | None, address: str | None) -> Swept:
    progress = Progress(layout.grid.size, sys.stderr)
    try:
        with executor(jobs, address) as (workers, count):
            # Twice as many pieces as workers, so that none waits for its next one.
            length = chunk_length(layout.chain.rods)
            return compute(layout, workers, 2 * count, length, progress.show)
    finally:
        progress.clear()


def _write(output: Path, protocol: Protocol, layout: Layout, swept: Swept) -> None:
    facts = provenance(protocol, layout)
    if _drawn(output):
        from rig.report.canvas import write_figure  # noqa: PLC0415 - it needs matplotlib
        from rig.report.sweep import sweep_figure  # noqa: PLC0415 - likewise

        write_figure(output, sweep_figure(facts, layout, swept))
        return
    with replacing(output) as stream:
        if output.suffix == ".npz":
            write_npz(stream, facts, protocol.text, layout, swept)
        else:
            write_csv(stream, facts, layout, swept)


def _drawn(output: Path) -> bool:
    return output.suffix.removeprefix(".") in KINDS


def _check_output(output: Path) -> None:
    """Find out before a long computation what would go wrong after it."""
    if output.suffix not in _KINDS:
        raise InputError(
            f"{output}: the ending {output.suffix or 'is missing and'} says no kind of file",
            f"end the name in one of {', '.join(_KINDS)}",
        )
    check_place(output)
    if _drawn(output):
        import_module("matplotlib")


def _check_drawable(layout: Layout) -> None:
    axes = layout.grid.axes
    if layout.layered:
        inclines = ", ".join(f"{value:g}" for value in axes[0].values)
        raise InputError(
            f"a picture shows one incline, and the plan has {inclines} degrees",
            f"choose one, as in --vary incline={axes[0].values[-1]:g}deg, or write .csv or .npz",
        )
    if len(axes) > 2:
        raise InputError(
            f"a picture has one axis or two, not {len(axes)}", "hold some, or write .csv or .npz"
        )


def _summary(swept: Swept) -> str:
    """Count the points, and those of which a reader of the file should know."""
    parts = [f"{swept.notes.size} points"]
    for number, words in (
        (swept.notes.size - int(swept.in_domain.sum()), "beyond the model's domain"),
        (int(((swept.notes & NO_ANSWER) > 0).sum()), "without an answer"),
        (int(((swept.notes & PILE) > 0).sum()), "on the pile"),
    ):
        if number:
            parts.append(f"{number} {words}")
    return ", ".join(parts)


_REDRAW_S = 0.1
_QUIET_S = 2.0  # what takes no longer needs no log lines


class Progress:
    """Shows the share of the points that is done, their rate and the time left.

    Parameters
    ----------
    size
        Number of points.
    stream
        Where to show it: on a terminal one line, rewritten; elsewhere a line a quarter.
    clock
        Seconds, from any origin.
    """

    def __init__(
        self, size: int, stream: TextIO, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._size, self._stream, self._clock = size, stream, clock
        self._terminal = stream.isatty()
        self._start = self._last = clock()
        self._quarter = 0
        self._drawn = False

    def show(self, done: int) -> None:
        """Take note of `done` points, and show it if it is time."""
        now = self._clock()
        quarter = 4 * done // self._size
        if self._terminal:
            due = now - self._last >= _REDRAW_S
        else:
            due = now - self._last >= _QUIET_S and self._quarter < quarter < 4
        if not due:
            return
        self._last, self._quarter, self._drawn = now, quarter, True
        rate = done / (now - self._start)
        left = (self._size - done) / rate
        line = f"{done / self._size:4.0%} of {self._size} points, {rate:.3g}/s, {left:.0f} s left"
        self._write(f"\r{line}\x1b[K" if self._terminal else f"{line}\n")

    def clear(self) -> None:
        """Leave the terminal's line empty for what is said next."""
        if self._terminal and self._drawn:
            self._write("\r\x1b[K")

    def _write(self, text: str) -> None:
        with suppress(OSError):  # a sweep does not end because nobody looks any more
            self._stream.write(text)
            self._stream.flush()

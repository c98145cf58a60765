"""``rig sweep``."""

import sys
import time
from importlib import import_module
from pathlib import Path

from rig.commands.output import Arguments, goes_on, say, stage
from rig.files import replacing
from rig.protocol import reader
from rig.protocol.protocol import Protocol
from rig.report.canvas import ENDINGS, write_figure
from rig.report.templates import sentence
from rig.sweep.compute import NO_ANSWER, PILE, Swept, chunk_length, compute
from rig.sweep.executor import executor
from rig.sweep.layout import Layout, lay_out
from rig.sweep.tables import provenance, write_csv, write_npz


def main(arguments: Arguments) -> None:
    """Compute a sweep and write it to a file."""
    output: Path = arguments.output
    protocol = reader.read(arguments.protocol)
    layout = lay_out(protocol, arguments.vary)
    if output.suffix in ENDINGS:  # found out now, not after a long computation
        import_module("rig.report.sweep").check_drawable(layout)
    with goes_on("nothing was written"):
        swept = _compute(layout, arguments.jobs, arguments.cluster)
        _write(output, protocol, layout, swept)
    masks = ~swept.in_domain, swept.notes & NO_ANSWER > 0, swept.notes & PILE > 0
    say(f"{output}: {sentence('swept', layout.size, *(points.sum() for points in masks))}")


def _compute(layout: Layout, jobs: int | None, address: str | None) -> Swept:
    size, start = layout.size, time.monotonic()
    due = 1  # quarter of the points

    def show(done: int) -> None:
        nonlocal due
        rate = done / (time.monotonic() - start)
        rest = (size - done) / rate
        line = f"{done / size:4.0%} of {size} points, {rate:.3g}/s, {rest:.0f} s left"
        if sys.stderr.isatty():
            stage(line)
        elif due <= 4 * done // size < 4:  # a log keeps every line: three are enough
            due = 4 * done // size + 1
            say(line)

    try:
        with executor(jobs, address) as (workers, count):
            # Twice as many pieces as workers, so that none waits for its next one.
            length = chunk_length(layout.chain.rods)
            return compute(layout, workers, 2 * count, length, show)
    finally:
        stage("")


def _write(output: Path, protocol: Protocol, layout: Layout, swept: Swept) -> None:
    facts = provenance(protocol, layout)
    if output.suffix in ENDINGS:
        from rig.report.sweep import sweep_figure  # noqa: PLC0415 - it needs matplotlib

        write_figure(output, sweep_figure(facts, layout, swept))
        return
    with replacing(output) as stream:
        if output.suffix == ".npz":
            write_npz(stream, facts, protocol.text, layout, swept)
        else:
            write_csv(stream, facts, layout, swept)

"""``./run bench resolved``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bench.studies.figures import work_figure
from bench.studies.resolved import film, published, work
from rig.commands.output import print_found, print_json, say, write_page
from rig.files import make_folder, write_atomic
from rig.report.film import film_figure
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
_WORK_HEAD = """\
# Error against run time of the resolved world

`./run bench resolved --work`: three rods fall with several steps, methods, contacts and strings.
Errors are against the finest of each kind. Times are of one machine.

![Error against run time](resolved-work.svg)"""


def main(arguments: Namespace) -> int:
    """Keep and print what is asked for."""
    if arguments.work:
        return _work(arguments)
    if arguments.published:
        return _published(arguments)
    drawing = make_folder(arguments.output) / "resolved-fall.svg"
    write_atomic(drawing, film_figure(film(arguments.protocols, arguments.film)))
    say(str(drawing))
    return 0


def _work(arguments: Namespace) -> int:
    """Keep and print error against run time of the world itself."""
    folder = make_folder(arguments.output)
    lines = work()
    write_atomic(folder / "resolved-work.csv", csv_text(lines[0], lines))
    write_atomic(folder / "resolved-work.svg", work_figure(lines))
    rows = [["", "step (µs)", "touch (ms)", "rms error of Δz (mm)", "worst", "time a fall (s)"]]
    rows += [
        [one["changed"], f"{1e6 * one['step_s']:g}", f"{1e3 * one['touch_s']:g}",
         *("–" if one[name] is None else f"{1e3 * one[name]:.4f}" for name in ("rms_m", "worst_m")),
         f"{one['cpu_s']:.3g}"]
        for one in lines
    ]  # fmt: skip
    table = text_table(rows, left={0}, rule=True)
    write_page(folder, "resolved-work", _WORK_HEAD, table)
    print_found({"settings": lines}, lambda: "\n".join(table), as_json=arguments.json)
    return 0


def _published(arguments: Namespace) -> int:
    """Keep and print how chains of other experiments fall."""
    folder = make_folder(arguments.output)
    lines = published()
    write_atomic(folder / "resolved-published.csv", csv_text(lines[0], lines))
    if arguments.json:
        print_json({"results": lines})
        return 0
    rows = [["", "of", "mean", "sd", "falls"]]
    rows += [
        [one["what"], one["of"], f"{one['mean']:.4f}",
         "–" if one["sd"] is None else f"{one['sd']:.4f}", str(one["n"])]
        for one in lines
    ]  # fmt: skip
    print("\n".join(["SIMULATED DATA", *text_table(rows, left={0, 1}, rule=True)]))
    return 0

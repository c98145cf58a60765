"""``./run bench resolved``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bench.studies.figures import resolved_figure, work_figure
from bench.studies.resolved import CASES, DROPS, as_json, film, published, study, work
from rig.commands.output import leave_study, named, print_found, print_json, say, write_page
from rig.files import make_folder, write_atomic
from rig.measurands import told
from rig.report.film import film_figure
from rig.text_table import csv_text, text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping, Sequence

    from bench.studies.resolved import JudgedDrop

    Record = Mapping[str, Any]

_TOLD = ("separation_m", "separation_strike_m", "speed_m_s", "speed_strike_m_s", "release_skew_s",
         "contact_height_m", "turning_rad_s", "slack")  # fmt: skip
_HEAD = """\
# Sessions of the resolved world

`./run bench resolved`: rigid rods on strings, one rig a case, read as usual. Void shares are of
drops within the limit of release skew; errors are of drops that were not void. Every drop is in
`resolved.csv`.

![Errors against inclination](resolved.svg)"""

_WORK_HEAD = """\
# Error against run time of the resolved world

`./run bench resolved --work`: three rods fall with several steps, methods, contacts and strings.
Errors are against the finest of each kind. Times are of one machine.

![Error against run time](resolved-work.svg)"""


def main(arguments: Namespace) -> int:
    """Read sessions of the resolved world; keep table, picture and page, and print the table."""
    if arguments.work:
        return _work(arguments)
    if arguments.published:
        return _published(arguments)
    if arguments.film is not None:
        folder = make_folder(arguments.output)
        drawn = film_figure(film(arguments.protocols, arguments.film))
        write_atomic(folder / "resolved-fall.svg", drawn)
        say(f"{folder / 'resolved-fall.svg'}")
        return 0
    chosen = named(CASES, arguments.only or "")
    folder = make_folder(arguments.output)
    found = study(arguments.protocols, arguments.drops or DROPS, chosen, say)
    whole = as_json(found)
    table = ["by case:", *_table(whole["cases"])]
    leave_study(
        folder, "resolved", _HEAD, table, whole, _csv(found), resolved_figure(found),
        as_json=arguments.json,
    )  # fmt: skip
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


def _csv(drops: Sequence[JudgedDrop]) -> str:
    """One line a drop: its errors with U95, and what was true."""
    rows = [
        {"case": one.case, "incline_deg": one.incline_deg, "run": one.run, "verdict": one.verdict,
         "beyond": int(one.beyond), "wrong": one.wrong}
        | {f"true {name}": one.truth[name] for name in _TOLD}
        | {f"error {name}": error for name, (error, *_) in one.errors.items()}
        | {f"U95 {name}": expanded for name, (_, expanded, _) in one.errors.items()}
        for one in drops
    ]  # fmt: skip
    return csv_text(dict.fromkeys(name for row in rows for name in row), rows)


def _table(records: Sequence[Record]) -> list[str]:
    shown = [row for row in told() if any(row.name in one["quantities"] for one in records)]
    head = ["", "drops", "void", "wrong"]
    for row in shown:
        head += [f"{row.label} rms ({row.fine})", "bias", "in U95", "rms / u"]
    rows = [head]
    for one in records:
        cells = [one["case"], str(one["drops"]), f"{one['void_share']:.0%}", str(one["wrong"])]
        for row in shown:
            errors = one["quantities"].get(row.name)
            cells += (
                ["–"] * 4
                if errors is None
                else [
                    f"{errors['rms'] * row.fine_scale:.2f}",
                    f"{errors['bias'] * row.fine_scale:+.2f}",
                    f"{errors['coverage']:.0%}",
                    f"{errors['times_u']:.1f}",
                ]
            )
        rows.append(cells)
    return text_table(rows, left={0}, rule=True)

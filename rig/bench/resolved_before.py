"""Sessions of the resolved world as an earlier analysis read them, beside what is found now."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any

from rig.bench.resolved import JudgedDrop, summary
from rig.errors import InputError
from rig.measurands import told
from rig.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

_NEEDED = ("case", "incline_deg", "run", "verdict", "beyond", "wrong")


def read_before(path: Path) -> list[JudgedDrop]:
    """Read the drops that ``rig bench resolved`` kept as CSV.

    Parameters
    ----------
    path
        Of ``resolved.csv``. It says nothing of rms / u and of reasons.

    Raises
    ------
    InputError
        There is no such file, or it is none of these.
    """
    try:
        with path.open(newline="", encoding="utf-8") as table:
            return [_drop(row) for row in csv.DictReader(table)]
    except OSError as error:
        raise InputError(
            f"{path}: {error.strerror}", "name a folder that `rig bench resolved -o DIR` wrote"
        ) from None
    except (KeyError, TypeError, ValueError, csv.Error):
        raise InputError(
            f"{path} is no table of `rig bench resolved`",
            f"its columns are {', '.join(_NEEDED)}, …",
        ) from None


def _drop(row: Mapping[str, str]) -> JudgedDrop:
    case, incline, run, verdict, beyond, wrong = (row[name] for name in _NEEDED)
    errors = {
        name.removeprefix("error "): (float(text), u := float(row[_u95(name)]), u / 2.0)
        for name, text in row.items()
        if name.startswith("error ") and text
    }
    truth = {
        name.removeprefix("true "): float(text)
        for name, text in row.items()
        if name.startswith("true ") and text
    }
    return JudgedDrop(
        case, float(incline), int(run), verdict, (), bool(int(beyond)), errors, int(wrong), truth
    )


def _u95(name: str) -> str:
    return name.replace("error ", "U95 ", 1)


def beside(before: Sequence[JudgedDrop], now: Sequence[JudgedDrop]) -> list[str]:
    """Write void share, rms error and share of intervals that hold of both, case by case."""
    falls = {_which(one): one.truth.get("separation_m") for one in before}
    same = sum(falls.get(_which(one), -1.0) == one.truth.get("separation_m") for one in now)
    shown = [row for row in told() if any(row.name in one.errors for one in [*before, *now])]
    head = ["", "drops", "void"]
    for row in shown:
        head += [f"{row.label} rms ({row.fine})", "in U95"]
    rows = [head]
    for case in dict.fromkeys(one.case for one in now):
        then, today = (summary([one for one in some if one.case == case]) for some in (before, now))
        cells = [
            case,
            _both(then["drops"], today["drops"], "d"),
            _both(then["void_share"], today["void_share"], ".0%"),
        ]
        for row in shown:
            one, other = (found["quantities"].get(row.name) for found in (then, today))
            cells.append(
                _both(
                    _value(one, "rms", row.fine_scale), _value(other, "rms", row.fine_scale), ".2f"
                )
            )
            cells.append(_both(_value(one, "coverage"), _value(other, "coverage"), ".0%"))
        rows.append(cells)
    told_of = f"before → now; {same} of {len(now)} drops are the same falls:"
    return [told_of, *text_table(rows, left={0}, rule=True)]


def _which(one: JudgedDrop) -> tuple[str, int]:
    return one.case, one.run


def _value(found: Mapping[str, Any] | None, name: str, scale: float = 1.0) -> float | None:
    return None if found is None else found[name] * scale


def _both(before: float | None, now: float | None, how: str) -> str:
    return " → ".join("–" if one is None else format(one, how) for one in (before, now))

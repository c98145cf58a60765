"""The summary as a table for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.report.columns import filled, summary_columns

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.report.columns import Column


def summary_table(analysis: Mapping[str, Any]) -> str:
    """Write the summary as aligned text.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.

    Returns
    -------
    str
        Lines without an end of line at the last; one sentence where there is no summary.
    """
    summary = analysis.get("summary") or ()
    if not summary:
        return "No accepted runs, so no summary."
    return "\n".join(aligned(summary_columns(), summary))


def aligned(columns: Sequence[Column], records: Sequence[Mapping[str, Any]]) -> list[str]:
    """Write records as lines of aligned text below their headings; empty columns are left out."""
    columns, rows = filled(columns, records)
    headings = [column.heading for column in columns]
    cells = [_align(list(column)) for column in zip(*rows, strict=True)]
    widths = [
        max(len(heading), *map(len, column))
        for heading, column in zip(headings, cells, strict=True)
    ]
    lines = [
        "  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)).rstrip()
        for line in [headings, *zip(*cells, strict=True)]
    ]
    rule = "  ".join("─" * width for width in widths)
    return [lines[0], rule, *lines[1:]]


def _align(column: Sequence[str]) -> list[str]:
    """Pad the part behind ``±`` so that the signs stand under each other."""
    behind = max(len(text.partition("±")[2]) for text in column)
    padded = []
    for text in column:
        before, sign, after = text.partition("±")
        padded.append(f"{before}±{after.ljust(behind)}" if sign else text)
    return padded

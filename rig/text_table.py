"""Text in columns: for a terminal, and as CSV for other programs."""

import csv
import io
from collections.abc import Container, Iterable, Mapping, Sequence


def text_table(
    rows: Sequence[Sequence[str]], *, left: Container[int] = (), rule: bool = False
) -> list[str]:
    """Lay rows of cells out as lines, each column as wide as its widest cell.

    Parameters
    ----------
    rows
        The headings, then a row a line; all of the same length.
    left
        Columns of words, which begin under each other; all others end under each other.
    rule
        Whether a line is drawn below the headings.
    """
    columns = [_signs_aligned(column) for column in zip(*rows, strict=True)]
    widths = [max(map(len, column)) for column in columns]
    lines = [
        "  ".join(
            cell.ljust(width) if n in left else cell.rjust(width)
            for n, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in zip(*columns, strict=True)
    ]
    if rule:
        lines.insert(1, "  ".join("─" * width for width in widths))
    return lines


def csv_text(columns: Iterable[str], rows: Iterable[Mapping[str, object]]) -> str:
    """Write rows as CSV below their columns' names.

    Parameters
    ----------
    columns
        What a row has beyond them is left out, what it lacks is empty.
    rows
        Values by column; floats get the digits that give the same float back.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, [*columns], extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _signs_aligned(column: Sequence[str]) -> list[str]:
    """Pad what is behind ``±`` so that the signs stand under each other, but for the heading's."""
    heading, *cells = column
    behind = max((len(cell.partition("±")[2]) for cell in cells), default=0)
    padded = []
    for cell in cells:
        before, sign, after = cell.partition("±")
        padded.append(f"{before}±{after.ljust(behind)}" if sign else cell)
    return [heading, *padded]

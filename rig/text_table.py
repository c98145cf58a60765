"""Text in columns: for a terminal, and as CSV for other programs."""

import csv
import io
from collections.abc import Collection, Container, Iterable, Mapping, Sequence
from itertools import chain


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
    columns = []
    for n, column in enumerate(zip(*rows, strict=True)):
        cells = _signs_aligned(column)
        width = max(map(len, cells))
        columns.append([cell.ljust(width) if n in left else cell.rjust(width) for cell in cells])
    lines = ["  ".join(row).rstrip() for row in zip(*columns, strict=True)]
    if rule:
        lines.insert(1, "  ".join("─" * len(heading) for heading, *_ in columns))
    return lines


def csv_text(rows: Collection[Mapping[str, object]], columns: Iterable[str] = ()) -> str:
    """Write rows as CSV below their columns' names.

    Parameters
    ----------
    rows
        Values by column; floats get the digits that give the same float back.
    columns
        What a row has beyond them is left out, what it lacks is empty. By default all that any row
        has, in the order of the fullest: a void run may lack some that later runs have.
    """
    fullest = sorted(rows, key=len, reverse=True)
    heading = [*columns] or [*dict.fromkeys(chain.from_iterable(fullest))]
    text = io.StringIO()
    writer = csv.DictWriter(text, heading, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _signs_aligned(column: Sequence[str]) -> list[str]:
    """Pad what is behind ``±`` so that the signs stand under each other, but for the heading's."""
    heading, *cells = column
    lengths = [len(cell.partition("±")[2]) for cell in cells]
    gaps = (max(lengths, default=0) - length for length in lengths)
    padded = (cell + " " * gap * ("±" in cell) for cell, gap in zip(cells, gaps, strict=True))
    return [heading, *padded]

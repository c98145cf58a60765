"""Tables of studies: which number of a row stands below which heading, and how it is written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rig.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from rig.bench.work import Point


class Column(NamedTuple):
    """A heading with its unit, the key of its values, and their format and scale.

    What has no format is words, which begin under each other.
    """

    heading: str
    key: str
    form: str = ""
    scale: float = 1

    def cell(self, row: Mapping[str, Any]) -> str:
        """Write the value of a row; a dash where there is none."""
        value = row.get(self.key)
        if value is None or not self.form:
            return "–" if value is None else str(value)
        return format(self.scale * value, self.form)


def aligned(columns: Sequence[Column], rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Write rows as lines of aligned text below their headings; none of no rows."""
    words = {place for place, column in enumerate(columns) if not column.form}
    heading = [column.heading for column in columns]
    cells = [[column.cell(row) for column in columns] for row in rows]
    return text_table([heading, *cells], left=words, rule=True) if rows else []


_POINT = (
    Column("method", "method"), Column("setting", "setting"), Column("error", "error", ".1e"),
    Column("ms", "cpu_s", ".4g", 1e3),
)  # fmt: skip


def points_table(points: Iterable[Point]) -> list[str]:
    """Write every point, for problems whose errors are far from those that others reach."""
    return aligned(_POINT, [point._asdict() for point in points])

"""``./run bench foretold``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bench.studies.foretold import PROTOCOLS, Foretold, foretold
from rig.commands.output import leave_study, say
from rig.files import make_folder
from rig.measurands import MEASURANDS
from rig.report.columns import Column, aligned
from rig.report.estimate import symbol
from rig.text_table import csv_text

if TYPE_CHECKING:
    from argparse import Namespace

_HEAD = """\
# Does a session reach the u that was predicted?

`./run bench foretold`: u of one run by `rig design`, from the stated and from the learned
scatter, beside u of a simulated session. The last column is session over prediction from the
learned scatter; 1 is agreement."""


def main(arguments: Namespace) -> int:
    """Compare forecast and session on each protocol."""
    names = [name for name in PROTOCOLS if (arguments.only or "") in name]
    folder = make_folder(arguments.output)
    found = foretold(names or PROTOCOLS, arguments.repeats, arguments.seed, say)
    records = [one.json() for one in found]
    leave_study(
        folder, "foretold", _HEAD, aligned(_COLUMNS, found), {"foretold": records},
        csv_text(records[0], records), as_json=arguments.json,
    )  # fmt: skip
    return 0


def _what(one: Foretold) -> str:
    row = MEASURANDS.get(one.quantity)
    return symbol(one.quantity) if row is None else f"u of {row.symbol}, one run ({row.fine})"


def _size(one: Foretold, u: float) -> str:
    row = MEASURANDS.get(one.quantity)
    return f"{u * (1.0 if row is None else row.fine_scale):.3g}"


_COLUMNS: tuple[Column[Foretold], ...] = (
    Column("protocol", lambda one: one.protocol, numeric=False),
    Column("quantity", _what, numeric=False),
    Column("runs", lambda one: str(one.runs)),
    Column("foretold by what is stated", lambda one: _size(one, one.by_stated)),
    Column("by what was learned", lambda one: _size(one, one.by_learned)),
    Column("found", lambda one: _size(one, one.found)),
    Column("found / foretold", lambda one: f"{one.found / one.by_learned:.2f}"),
)

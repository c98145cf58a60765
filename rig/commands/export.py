"""``rig export``."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from rig.bundle.tables import csv_files
from rig.cache.entry import recall
from rig.commands.output import progress, say, tell_damage
from rig.files import make_folder, write_atomic
from rig.results import results, tick_rates
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.results import SessionResults


def main(arguments: Namespace) -> int:
    """Write a session as CSV files."""
    with Session.open(arguments.session, readonly=True) as session:
        folder = make_folder(arguments.csv)
        outcome = results(session, progress("analysing run"), fresh=arguments.fresh)
        make = partial(_tables, session, outcome)
        tables = recall(dict, make, "tables", outcome.digest, fresh=arguments.fresh)
        for name, text in tables.items():
            write_atomic(folder / name, text)
    say(f"CSV files: {arguments.csv}")
    return tell_damage(outcome.analysis)


def _tables(session: Session, outcome: SessionResults) -> dict[str, str]:
    return csv_files(session, outcome.json(), tick_rates(session))

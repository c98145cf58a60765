"""``rig export``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.commands.output import progress, say, tell_damage
from rig.files import make_folder
from rig.results import results, tick_rates
from rig.session.export import export_csv
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Write a session as CSV files."""
    with Session.open(arguments.session, readonly=True) as session:
        make_folder(arguments.csv)
        found = results(session, progress("analysing run"))
        export_csv(arguments.csv, session, found.json(), tick_rates(session))
    say(f"CSV files: {arguments.csv}")
    return tell_damage(found.analysis)

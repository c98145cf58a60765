"""``rig export``."""

from rig.bundle.tables import csv_files
from rig.commands.output import Arguments, progress, say, tell_damage
from rig.files import make_folder, write_atomic
from rig.results.whole import results
from rig.session.store import Session


def main(arguments: Arguments) -> int:
    """Write a session as CSV files, or as one file that another person can check."""
    if arguments.bundle is not None:
        from rig.commands.bundling import write_bundle  # noqa: PLC0415 - it draws a report

        return write_bundle(arguments)
    with Session.open(arguments.session, readonly=True) as session:
        folder = make_folder(arguments.csv)
        outcome = results(session, progress, fresh=arguments.fresh)
        for name, text in csv_files(session, outcome).items():
            write_atomic(folder / name, text)
    say(f"CSV files: {arguments.csv}")
    return tell_damage(outcome.analysis)

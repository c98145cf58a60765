"""Making the files of a bundle from its session file, for ``rig export`` and ``rig verify``."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from rig.analysis.session import Analysis
from rig.bundle.archive import pack
from rig.bundle.contents import SESSION, bundle_files, copy_session
from rig.commands.output import Arguments, progress, say, tell_damage
from rig.commands.report import make_report
from rig.files import write_atomic
from rig.recover.examine import ExaminedFile, examine
from rig.report.canvas import figure_file
from rig.report.finding import deviations
from rig.report.templates import lines
from rig.results import protocol_of, results
from rig.session.hashes import protocol_first
from rig.session.reading import Reader
from rig.session.store import Session

_FIXED = {True: "yes", False: "no", None: "unknown"}


class DerivedBundle(NamedTuple):
    """All files that follow from a session file, its analysis, and the state of the file."""

    files: dict[str, bytes]
    analysis: Analysis
    examined: ExaminedFile


def write_bundle(arguments: Arguments) -> int:
    """Write a session as a bundle; the same session gives the same bytes."""
    secret = None
    if arguments.sign is not None:
        from rig.bundle import signing  # noqa: PLC0415 - an extra that few need

        secret = signing.read_secret(arguments.sign)
    with Session.open(arguments.session, readonly=True) as session:
        data = copy_session(session)
    derived = derive_bundle(data)
    files = signing.sign(derived.files, secret) if secret else derived.files
    write_atomic(arguments.bundle, pack(files))
    say(f"bundle: {arguments.bundle}; rig verify {arguments.bundle} checks it")
    return tell_damage(derived.analysis)


def derive_bundle(data: bytes) -> DerivedBundle:
    """Derive all files of a bundle from its session file.

    Raises
    ------
    SessionError
        It cannot be read.
    """
    with TemporaryDirectory(prefix="rig-bundle-") as folder:
        copy = Path(folder) / SESSION
        copy.write_bytes(data)
        examined = examine(copy)
        with Session.open(copy, readonly=True) as session:
            # Every number from the raw edges: what is kept of earlier results proves nothing.
            outcome = results(session, progress, fresh=True)
            report = make_report(session, outcome, "U95", estimate=False, fresh=True)
            drawn = {"report.html": report.html.encode()} | {
                f"figures/figure-{number}.svg": figure_file(figure, "svg")
                for number, figure in enumerate(report.figures, 1)
            }
            history = describe_history(session, examined, outcome.analysis)
            files = bundle_files(session, data, outcome, drawn, history)
    return DerivedBundle(files, outcome.analysis, examined)


def describe_history(session: Reader, examined: ExaminedFile, analysis: Analysis) -> list[str]:
    """List what was fixed beforehand, deviations from the plan, unblinding and attached files."""
    protocol = protocol_of(session)
    links = examined.rows.in_order("hash")
    if next(session.byte_log(), None) is None:
        first = "unknown, the edges were imported"
    elif not links:
        first = "unknown, an older program recorded the session, without a chain of hashes"
    else:
        broken = any("table protocol" in line or "table hash" in line for line in examined.damage)
        first = "no" if broken else _FIXED[protocol_first(links)]
    changes = deviations(protocol, analysis, session.states())
    return lines("history", session, first, changes, protocol.blind)

"""Bundles: ``rig export --bundle`` makes one, ``rig verify`` makes its files again and compares."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from rig.analysis.session import Analysis
from rig.bundle import contents
from rig.bundle.archive import PUBLIC_KEY, SIGNATURE, is_bundle, pack, read_bundle
from rig.commands.output import VOID, Arguments, progress, say, show, tell_damage
from rig.commands.report import make_report
from rig.errors import SessionError
from rig.files import write_atomic
from rig.reasons import rig_error
from rig.recover.examine import FAULTS, ExaminedFile, describe, examine
from rig.report.canvas import figure_file
from rig.report.finding import deviations
from rig.report.templates import lines
from rig.results.whole import protocol_of, results
from rig.session.hashes import protocol_first
from rig.session.reading import Reader
from rig.session.store import Session


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
        data = contents.copy_session(session)
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
        copy = Path(folder) / contents.SESSION
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
            files = contents.bundle_files(session, outcome, drawn, history)
    return DerivedBundle(files, outcome.analysis, examined)


def describe_history(session: Reader, examined: ExaminedFile, analysis: Analysis) -> list[str]:
    """List what was fixed beforehand, deviations from the plan, unblinding and attached files."""
    protocol = protocol_of(session)
    imported = any("file" in about for _, about in session.identities())
    links = examined.rows.in_order("hash")
    broken = any("table protocol" in line or "table hash" in line for line in examined.damage)
    first = False if broken else protocol_first(links)
    changes = deviations(protocol, analysis, session.states())
    return lines("history", session, imported, links, first, changes, protocol.blind)


def verify(arguments: Arguments) -> int:
    """Check a bundle, the folder that it was unpacked into, or a session file."""
    check = _check_bundle if is_bundle(arguments.file) else _check_session
    findings = dict.fromkeys(check(arguments.file, arguments.key))
    faults = [line for line in findings if line.startswith((contents.WRONG, *FAULTS))]
    verdict = "not as recorded" if faults else "as recorded"
    show([*(line for line in findings if line not in faults), *faults, f"verdict: {verdict}"])
    return VOID if faults else 0


def _check_session(path: str, key: str | None) -> Iterator[str]:
    if key is not None:
        raise rig_error("key_without_bundle", path=path)
    examined = examine(path)
    yield from describe(examined)
    with Session.open(path, readonly=True) as session:
        analysis = results(session, progress, fresh=True).analysis
        yield from describe_history(session, examined, analysis)


def _check_bundle(path: str, key: str | None) -> Iterator[str]:
    stored, altered = read_bundle(path)
    yield f"files: {len(stored)}, {'not as packed' if altered else 'all hashes agree'}"
    yield from (contents.WRONG + text for text in altered)
    if key is None and not {SIGNATURE, PUBLIC_KEY} & stored.keys():
        yield "signature: none"
    else:
        from rig.bundle.signing import check_signature  # noqa: PLC0415 - an extra that few need

        yield check_signature(stored, key)
    if contents.SESSION not in stored:
        return
    try:
        derived = derive_bundle(stored[contents.SESSION])
    except SessionError as error:
        yield contents.WRONG + error.message
        return
    yield from describe(derived.examined)[1:]
    yield from contents.compare(stored, derived.files)
    for words, files in (("made", stored), ("verified", derived.files)):
        yield f"{words} with: {_versions(files)}"
    yield from derived.files[contents.HISTORY].decode().splitlines()


def _versions(files: Mapping[str, bytes]) -> str:
    try:
        versions = json.loads(files.get(contents.ENVIRONMENT, b""))
        return ", ".join(f"{name} {number}" for name, number in versions.items())
    except (ValueError, AttributeError):
        return "unknown"

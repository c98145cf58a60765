"""``rig verify``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from rig.bundle.archive import is_archive, read_bundle
from rig.bundle.check import check_hashes, compare
from rig.bundle.contents import ENVIRONMENT, HISTORY, SESSION
from rig.bundle.history import describe_history
from rig.bundle.signing import PUBLIC_KEY, check_signature
from rig.commands.bundling import make_files
from rig.commands.output import VOID, progress, show
from rig.errors import SessionError
from rig.results import protocol_of, results
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.analysis.session import Analysis


def main(arguments: Namespace) -> int:
    """Check a bundle, its unpacked folder or a session file."""
    bundled = Path(arguments.file).is_dir() or is_archive(arguments.file)
    lines, faults = (_verify_bundle if bundled else _verify_session)(arguments)
    verdict = "not as recorded" if faults else "as recorded"
    show([*lines, *(f"wrong: {fault}" for fault in faults), f"verdict: {verdict}"])
    return VOID if faults else 0


def _verify_session(arguments: Namespace) -> tuple[list[str], list[str]]:
    with Session.open(arguments.file, readonly=True) as session:
        found = results(session, progress("analysing run"))
        history = describe_history(session, protocol_of(session), found.analysis)
    lines = ["numbers: a session file holds none; export a bundle to have them compared"]
    return [*_drops(found.analysis), *lines, *history], found.analysis.damage


def _verify_bundle(arguments: Namespace) -> tuple[list[str], list[str]]:
    stored, around = read_bundle(arguments.file)
    # The archive has a checksum of each file too, so an altered file shows around it as well.
    faults = check_hashes(stored) or around
    signature, sound = check_signature(stored, arguments.key)
    lines = [f"files: {len(stored)}, {'hashes agree' if not faults else 'not as recorded'}"]
    if sound:
        lines.append(signature)
    else:
        faults.append(signature)
    if SESSION not in stored:
        return lines, faults
    extra = {name: stored[name] for name in (PUBLIC_KEY,) if name in stored}
    try:
        derived, found = make_files(stored[SESSION], extra)
    except SessionError as error:
        return lines, [*faults, error.message]
    compared = compare(stored, derived)
    agree = "all digits agree" if compared.exact else f"{compared.digits} digits agree"
    lines += [
        *_drops(found.analysis),
        f"numbers: {compared.numbers} derived again from the raw edges; {agree}",
        f"made with: {_versions(stored.get(ENVIRONMENT, b''))}",
        f"verified with: {_versions(derived[ENVIRONMENT])}",
        *derived[HISTORY].decode().splitlines(),
    ]
    return lines, [*faults, *found.analysis.damage, *compared.differences]


def _drops(analysis: Analysis) -> list[str]:
    count = len(analysis.runs) + len(analysis.superseded)
    return [f"drops: {count}, {len(analysis.damaged)} damaged (each compared with its bytes)"]


def _versions(text: bytes) -> str:
    try:
        return ", ".join(f"{name} {number}" for name, number in json.loads(text).items())
    except (ValueError, AttributeError):
        return "unknown"

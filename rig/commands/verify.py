"""``rig verify``."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from rig.bundle.archive import PUBLIC_KEY, SIGNATURE, is_bundle, read_bundle
from rig.bundle.contents import ENVIRONMENT, HISTORY, SESSION, compare
from rig.commands.bundling import derive_bundle, describe_history
from rig.commands.output import VOID, progress, show
from rig.errors import InputError, SessionError
from rig.reasons import make_error
from rig.recover.examine import examine
from rig.results import results
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping

    from rig.analysis.session import Analysis
    from rig.recover.examine import ExaminedFile


def main(arguments: Namespace) -> int:
    """Check a bundle, the folder that it was unpacked into, or a session file."""
    lines: list[str] = []
    faults: list[str] = []
    if is_bundle(arguments.file):
        _verify_bundle(arguments, lines, faults)
    elif arguments.key is None:
        _verify_session(arguments, lines, faults)
    else:
        raise make_error(InputError, "key_without_bundle", path=arguments.file)
    verdict = "not as recorded" if faults else "as recorded"
    show([*lines, *(f"wrong: {text}" for text in dict.fromkeys(faults)), f"verdict: {verdict}"])
    return VOID if faults else 0


def _verify_session(arguments: Namespace, lines: list[str], faults: list[str]) -> None:
    examined = examine(arguments.file)
    with Session.open(arguments.file, readonly=True) as session:
        analysis = results(session, progress("analysing run"), fresh=True).analysis
        _describe(examined, analysis, lines, faults)
        lines += ["numbers: a session holds none; rig export --bundle makes a file that does"]
        lines += describe_history(session, examined, analysis)


def _verify_bundle(arguments: Namespace, lines: list[str], faults: list[str]) -> None:
    stored, altered = read_bundle(arguments.file)
    faults += altered
    lines.append(f"files: {len(stored)}, {'not all' if altered else 'all'} hashes agree")
    _check_signature(stored, arguments.key, lines, faults)
    if SESSION not in stored:
        return
    try:
        derived = derive_bundle(stored[SESSION])
    except SessionError as error:
        faults.append(error.message)
        return
    _describe(derived.examined, derived.analysis, lines, faults)
    compared = compare(stored, derived.files)
    lines += [
        str(compared),
        f"made with: {_versions(stored.get(ENVIRONMENT, b''))}",
        f"verified with: {_versions(derived.files[ENVIRONMENT])}",
        *derived.files[HISTORY].decode().splitlines(),
    ]
    faults += compared.differences


def _check_signature(
    files: Mapping[str, bytes], key: str | None, lines: list[str], faults: list[str]
) -> None:
    if key is None and not {SIGNATURE, PUBLIC_KEY} & files.keys():
        lines.append("signature: none")
        return
    from rig.bundle.signing import check_signature  # noqa: PLC0415 - an extra that few need

    sentence, sound = check_signature(files, key)
    (lines if sound else faults).append(sentence)


def _describe(
    examined: ExaminedFile, analysis: Analysis, lines: list[str], faults: list[str]
) -> None:
    """Say what the rows of a session file are worth."""
    links, states = examined.rows.in_order("hash"), "all agree"
    count = len(analysis.runs) + len(analysis.superseded)
    lines.append(f"drops: {count}, {len(analysis.damaged)} damaged; each compared with its bytes")
    if examined.troubles:
        states = "not all agree"
    since = ", begun later than the session" if any(not link[3] for link in links) else ""
    words = f"{len(links)}, {states}{since}" if links else "none; an older program recorded it"
    lines.append(f"linked hashes of rows: {words}")
    lost = examined.lost
    faults += [f"lost: {text}" if text in lost else text for text in examined.troubles]
    faults += analysis.damage


def _versions(text: bytes) -> str:
    try:
        return ", ".join(f"{name} {number}" for name, number in json.loads(text).items())
    except (ValueError, AttributeError):
        return "unknown"

"""``rig verify``."""

import json
from collections.abc import Iterator, Mapping

from rig.bundle.archive import PUBLIC_KEY, SIGNATURE, is_bundle, read_bundle
from rig.bundle.contents import ENVIRONMENT, HISTORY, SESSION, WRONG, compare
from rig.commands.bundling import derive_bundle, describe_history
from rig.commands.output import VOID, Arguments, progress, show
from rig.errors import SessionError
from rig.reasons import rig_error
from rig.recover.examine import FAULTS, describe, examine
from rig.results import results
from rig.session.store import Session


def main(arguments: Arguments) -> int:
    """Check a bundle, the folder that it was unpacked into, or a session file."""
    check = _check_bundle if is_bundle(arguments.file) else _check_session
    findings = dict.fromkeys(check(arguments.file, arguments.key))
    faults = [line for line in findings if line.startswith((WRONG, *FAULTS))]
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
    yield f"files: {len(stored)}, {'not all' if altered else 'all'} hashes agree"
    yield from (WRONG + text for text in altered)
    if key is None and not {SIGNATURE, PUBLIC_KEY} & stored.keys():
        yield "signature: none"
    else:
        from rig.bundle.signing import check_signature  # noqa: PLC0415 - an extra that few need

        yield check_signature(stored, key)
    if SESSION not in stored:
        return
    try:
        derived = derive_bundle(stored[SESSION])
    except SessionError as error:
        yield WRONG + error.message
        return
    yield from describe(derived.examined)[1:]
    yield from compare(stored, derived.files)
    for words, files in (("made", stored), ("verified", derived.files)):
        yield f"{words} with: {_versions(files)}"
    yield from derived.files[HISTORY].decode().splitlines()


def _versions(files: Mapping[str, bytes]) -> str:
    try:
        versions = json.loads(files.get(ENVIRONMENT, b""))
        return ", ".join(f"{name} {number}" for name, number in versions.items())
    except (ValueError, AttributeError):
        return "unknown"

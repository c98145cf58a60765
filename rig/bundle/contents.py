"""What a bundle holds: everything follows from the session file in it.

To verify a bundle is to make its files again and to compare.
"""

import json
import math
import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, suppress
from typing import Any

from rig.bundle.archive import CRATE, SUMS, seal, to_json
from rig.bundle.means import mean_tables
from rig.bundle.tables import csv_files, data_package
from rig.cache.entry import environment
from rig.results.whole import SessionResults, protocol_of
from rig.session.faults import translate_errors
from rig.session.reading import Reader

SESSION, RESULTS, ENVIRONMENT = "record.session", "results.json", "environment.json"
HISTORY = "deviations.txt"
WRONG = "wrong: "
"""A finding that begins so says what was altered."""
DIGITS = 6
"""Significant digits that other versions of the numerics must give again; a report shows two."""
_ALL = 17
"""Digits that say which double a number is."""


def copy_session(session: Reader) -> bytes:
    """Return a session's content as a file of its own; the same rows give the same bytes.

    What a log (``-wal``) beside the file adds is in it. The session stays as it is.

    Raises
    ------
    SessionError
        The file is damaged.
    """
    memory = sqlite3.connect(":memory:", isolation_level=None)
    with translate_errors(session.path), closing(memory):
        session.connection.backup(memory)
        memory.execute("VACUUM")  # how often and by whom pages were written is gone
        return memory.serialize()


def bundle_files(
    session: Reader, results: SessionResults, drawn: Mapping[str, bytes], history: Sequence[str]
) -> dict[str, bytes]:
    """Make all files of a bundle.

    Parameters
    ----------
    session
        The session file of the bundle, open.
    results
        Of it.
    drawn
        The report and its figures, by name.
    history
        What was fixed beforehand, and deviations.

    Returns
    -------
    dict
        Contents by name, ``SHA256SUMS`` included.
    """
    protocol = protocol_of(session)
    tables = csv_files(session, results)
    readme = tables.pop("README.txt")
    # What drops have in common, and so covariances, only a joint fit knows.
    tables |= mean_tables(protocol, results.complete or results.analysis)
    files = {
        **drawn,
        **{f"tables/{name}": text.encode() for name, text in tables.items()},
        "README.txt": readme.encode(),
        "protocol.yaml": session.protocol_text.encode(),
        HISTORY: "\n".join([*history, ""]).encode(),
        "tables/datapackage.json": to_json(data_package(tables)),
        RESULTS: to_json(results.json()),
        ENVIRONMENT: to_json(environment()),
        SESSION: session.path.read_bytes(),
    }
    for number, attached in enumerate(session.attached_files(), 1):
        name = re.sub(r"[^\w.-]+", "_", attached.name)
        files[f"attached/{number}-{name}"] = attached.data
    world = "Simulated drops: nothing fell." if session.simulated else "Drops past photogates."
    # The only date: no other would come again.
    return seal(files, protocol.title or "A session", world, session.meta["created"])


def compare(stored: Mapping[str, bytes], derived: Mapping[str, bytes]) -> Iterator[str]:
    """Compare a bundle with what follows from its session now.

    Results are compared number by number. All other files must have the same bytes, where program
    and numerics have the same versions; pictures and last digits differ between versions.

    Yields
    ------
    str
        In how many digits all results agree, then a line that begins with `WRONG` for each file or
        number that does not.
    """
    before, after = {}, dict(_leaves(json.loads(derived[RESULTS])))
    with suppress(ValueError):
        before = dict(_leaves(json.loads(stored.get(RESULTS, b"{}"))))
    equal = {place: _equal_digits(before.get(place), after.get(place)) for place in before | after}
    digits = min([n for n in equal.values() if n >= DIGITS], default=_ALL)
    agree = "all digits agree" if digits == _ALL else f"{digits} digits agree"
    count = sum(type(value) is float for value in after.values())
    yield f"numbers: {count} derived again from the raw edges; {agree}"
    if stored.get(ENVIRONMENT) == derived[ENVIRONMENT]:
        for name in sorted(derived.keys() - {SUMS, CRATE, RESULTS}):
            if stored.get(name) != derived[name]:
                yield f"{WRONG}{name} does not follow from {SESSION}"
    for place, n in equal.items():
        if n < DIGITS:
            words = [f"{side.get(place, 'nothing')!s:.40}" for side in (before, after)]
            yield f"{WRONG}{RESULTS}, {place[1:]}: {words[0]}; derived: {words[1]}"


def _leaves(value: Any, place: str = "") -> Iterator[tuple[str, object]]:
    """Spread JSON over its numbers and words, by place."""
    if isinstance(value, dict | list):
        for key, member in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _leaves(member, f"{place}.{key}")
    else:
        yield place, float(value) if type(value) in {int, float} else value


def _equal_digits(first: object, second: object) -> int:
    """Count the significant digits that two numbers share; of words all or none."""
    if first == second:
        return _ALL
    if not (isinstance(first, float) and isinstance(second, float)):
        return 0
    apart = abs(first - second) / max(abs(first), abs(second))
    return int(-math.log10(apart)) if 0.0 < apart < 1.0 else 0

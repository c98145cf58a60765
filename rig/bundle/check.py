"""Whether a bundle is as it was made, and whether its numbers follow from its edges."""

from __future__ import annotations

import csv
import json
import math
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.bundle.archive import SUMS
from rig.bundle.contents import ENVIRONMENT, ROWS, SESSION
from rig.bundle.crate import CRATE
from rig.bundle.digests import hash_rows, sha256
from rig.bundle.signing import SIGNATURE

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

DIGITS = 6
"""Significant digits that other versions of the numerics must give again; a report shows two."""
_ALL = 17
"""Digits that say which double a number is."""


class BundleComparison(NamedTuple):
    """Numbers of a bundle beside those derived again.

    Attributes
    ----------
    numbers
        How many were compared.
    digits
        Significant digits in which all agree, of those in no line of `differences`.
    differences
        A line for each file, number or word that does not agree.
    """

    numbers: int
    digits: int
    differences: list[str]

    @property
    def exact(self) -> bool:
        """Whether every number is the same to the last bit."""
        return self.digits == _ALL


def check_hashes(files: Mapping[str, bytes]) -> list[str]:
    """Compare every file with the hashes that the bundle states, and name what was altered."""
    sums = _read_sums(files[SUMS])
    stated = _crate_sums(files.get(CRATE, b""))
    faults = [f"{name} is not in {SUMS}" for name in sorted(files.keys() - sums.keys() - _OUTSIDE)]
    for name, digest in sorted(sums.items()):
        if name not in files:
            faults.append(f"{name} is missing")
        elif (own := sha256(files[name])) != digest:
            # Two lists state each hash: where one of them agrees, the other was altered.
            faults.append(
                f"{SUMS} was altered in the line of {name}"
                if stated.get(name) == own
                else f"{name} was altered{_place(name, files)}"
            )
    if not faults and files[SUMS] != "".join(f"{sums[n]}  {n}\n" for n in sorted(sums)).encode():
        faults.append(f"{SUMS} was altered")
    return faults


def compare(stored: Mapping[str, bytes], derived: Mapping[str, bytes]) -> BundleComparison:
    """Compare what a bundle holds with what follows from its session now.

    Files of numbers are compared number by number; other files, byte by byte, and only where the
    program and its numerics have the same versions.
    """
    same = stored.get(ENVIRONMENT) == derived[ENVIRONMENT]
    numbers, digits = 0, _ALL
    differences: list[str] = []
    for name in sorted(derived.keys() - {SUMS, CRATE, ENVIRONMENT, ROWS}):
        if name not in stored:
            differences.append(f"{name} is missing")
            continue
        mine, again = (dict(_leaves(name, files[name])) for files in (stored, derived))
        numbers += sum(isinstance(leaf, float) for leaf in again.values())
        for at in [*mine, *(at for at in again if at not in mine)]:
            equal = _equal_digits(mine.get(at), again.get(at))
            if equal >= DIGITS:
                digits = min(digits, equal)
            elif same or at:  # bytes of pictures and pages may differ between versions
                words = (
                    f"{mine.get(at, 'nothing')!s:.40}; derived: {again.get(at, 'nothing')!s:.40}"
                )
                differences.append(f"{name}, {at}: {words}" if at else f"{name} differs")
    return BundleComparison(numbers, digits, differences)


_OUTSIDE = {SUMS, SIGNATURE}
"""Files that no hash can cover: the list itself, and the signature of it."""


def _place(name: str, files: Mapping[str, bytes]) -> str:
    """Name the tables and drops of a session file that were altered."""
    if name != SESSION:
        return ""
    try:
        stated = json.loads(files[ROWS])
    except (KeyError, ValueError):
        return ""
    rows = hash_rows(files[SESSION])
    names = [row for row in {**stated, **rows} if stated.get(row) != rows.get(row)]
    return f": {', '.join(names)}" if names else ", outside of its rows"


def _read_sums(data: bytes) -> dict[str, str]:
    lines = data.decode("utf-8", "replace").splitlines()
    return {name: digest for digest, _, name in (line.partition("  ") for line in lines)}


def _crate_sums(data: bytes) -> dict[str, str]:
    try:
        graph = json.loads(data)["@graph"]
        return {row["@id"].removeprefix("./"): row["sha256"] for row in graph if "sha256" in row}
    except (ValueError, TypeError, KeyError, AttributeError):
        return {}


def _leaves(name: str, data: bytes) -> Iterator[tuple[str, object]]:
    """Spread a file over its numbers and words, by place; another kind of file is one leaf."""
    try:
        if name.endswith(".json"):
            yield from _members("", json.loads(data))
            return
        if name.endswith(".csv"):
            yield from _cells(data.decode())
            return
    except ValueError:  # no longer JSON or text
        pass
    yield "", data


def _members(at: str, value: Any) -> Iterator[tuple[str, object]]:
    if isinstance(value, dict | list):
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for key, member in pairs:
            yield from _members(f"{at}.{key}" if at else str(key), member)
    else:
        yield at, float(value) if type(value) in {int, float} else value


def _cells(text: str) -> Iterator[tuple[str, object]]:
    header, *rows = csv.reader(text.splitlines()) if text else [[]]
    yield "line 1", ",".join(header)
    for number, row in enumerate(rows, 2):
        for column, cell in zip(header, row, strict=False):
            try:
                yield f"line {number}, {column}", float(cell)
            except ValueError:
                yield f"line {number}, {column}", cell


def _equal_digits(one: object, other: object) -> int:
    """Count the significant digits that two numbers share; of words all or none."""
    if one == other:
        return _ALL
    if not (isinstance(one, float) and isinstance(other, float)):
        return 0
    apart = abs(one - other) / max(abs(one), abs(other))
    return int(-math.log10(apart)) if 0.0 < apart < 1.0 else 0

"""The ``.eln`` archive: stored files in fixed order, so that the same files give the same bytes.

Nothing is compressed. Every byte of the archive therefore follows from the files in it, and an
altered byte shows wherever it is.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import InputError
from rig.files import read_input
from rig.reasons import make_error

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

ROOT = "record/"
"""The one folder of the archive."""
SUMS = "SHA256SUMS"
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The first date that the format knows."""
_LOCAL_HEADER = 30
"""Bytes before a member's name (APPNOTE.TXT, 4.3.7)."""
_LARGEST = 1 << 31


class BundleContents(NamedTuple):
    """Files of a bundle by name, and what is wrong with the archive if all of them are right."""

    files: dict[str, bytes]
    faults: list[str]


def pack(files: Mapping[str, bytes]) -> bytes:
    """Return the archive of some files."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_STORED) as archive:
        for name in sorted(files):
            member = zipfile.ZipInfo(ROOT + name, _EPOCH)
            member.create_system = 3  # as on Unix, on every system
            archive.writestr(member, files[name])
    return packed.getvalue()


def read_bundle(path: str | os.PathLike[str]) -> BundleContents:
    """Read a bundle, or a folder that it was unpacked into.

    Raises
    ------
    InputError
        It is something else, or too large.
    """
    place = Path(path)
    files = _read_folder(place) if place.is_dir() else None
    if files is None:
        data = _read(place)
        files = _members(place, data)
    if SUMS not in files:
        raise _foreign(place, f"it has no {ROOT}{SUMS}")
    faults = [] if place.is_dir() else _archive_faults(files, data)
    return BundleContents(files, faults)


def is_archive(path: str | os.PathLike[str]) -> bool:
    """Whether a file is meant to be a bundle: by its beginning, its end or its name."""
    place = Path(path)
    return place.suffix == ".eln" or (place.is_file() and zipfile.is_zipfile(place))


def _members(place: Path, data: bytes) -> dict[str, bytes]:
    """Return the files of an archive, as stored; checksums of their own are not looked at."""
    files: dict[str, bytes] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OverflowError) as error:
        raise _foreign(place, f"its archive cannot be read ({error})") from error
    for member in members:
        name = member.filename
        begin = member.header_offset + _LOCAL_HEADER + len(name.encode())
        content = data[begin : begin + member.compress_size]
        if not name.startswith(ROOT) or ".." in name.split("/"):
            raise _foreign(place, f"it has {name!r:.60}, outside of {ROOT}")
        if name.removeprefix(ROOT) in files:
            raise _foreign(place, f"it has {name!r:.60} twice")
        if member.compress_type != zipfile.ZIP_STORED:
            raise _foreign(place, f"{name!r:.60} is compressed; rig stores files as they are")
        files[name.removeprefix(ROOT)] = content
    if sum(map(len, files.values())) > len(data):
        raise _foreign(place, "its members overlap")
    return files


def _archive_faults(files: Mapping[str, bytes], data: bytes) -> list[str]:
    """Say where an archive differs from the one that its files give."""
    again = pack(files)
    if again == data:
        return []
    at = next((n for n, (a, b) in enumerate(zip(data, again, strict=False)) if a != b), len(again))
    with zipfile.ZipFile(io.BytesIO(again)) as archive:
        members = [m.filename for m in archive.infolist() if m.header_offset <= at]
        directory = at >= archive.start_dir
    where = "in its directory" if directory else f"in the header of {members[-1]}"
    return [f"the archive itself was altered at byte {at}, {where}"]


def _read_folder(place: Path) -> dict[str, bytes]:
    folder = place if (place / SUMS).exists() else place / ROOT
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {path.relative_to(folder).as_posix(): _read(path) for path in paths}


def _read(path: Path) -> bytes:
    try:
        data = read_input(path, _LARGEST + 1)
    except OSError as error:
        raise make_error(InputError, "bundle_unreadable", path=path, text=error) from error
    if len(data) > _LARGEST:
        raise _foreign(path, f"it has more than {_LARGEST} bytes")
    return data


def _foreign(path: Path, text: str) -> InputError:
    return make_error(InputError, "bundle_foreign", path=path, text=text)

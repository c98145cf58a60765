"""The ``.eln`` archive: stored files in fixed order, so that the same files give the same bytes.

Nothing is compressed. Every byte of the archive follows from the files in it, and an altered byte
shows wherever it is. The description is an RO-Crate as the ELN consortium wants it: ``crate.json``
and a row a file.
"""

import hashlib
import io
import json
import mimetypes
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

from rig import __version__
from rig.errors import RigError
from rig.files import read_input
from rig.reasons import errors_become, rig_error
from rig.text_rows import read_text

ROOT = "record/"
"""The one folder of the archive."""
SUMS = "SHA256SUMS"
CRATE = "ro-crate-metadata.json"
PUBLIC_KEY, SIGNATURE = f"{SUMS}.pub", f"{SUMS}.minisig"
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The first date that the format knows."""
_LOCAL_HEADER = 30
"""Bytes before a member's name (APPNOTE.TXT, 4.3.7)."""
_LARGEST = 1 << 31


def sha256(data: bytes) -> str:
    """Return the SHA-256 of some bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def to_json(value: object) -> bytes:
    """Write a JSON file."""
    return (json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def seal(files: Mapping[str, bytes], title: str, words: str, date: str) -> dict[str, bytes]:
    """Add the crate's description and the list of hashes to some files.

    Parameters
    ----------
    files
        Contents by name.
    title, words, date
        The crate's ``name``, ``description`` and ``datePublished``.
    """
    kinds = mimetypes.MimeTypes()  # Python's own list: the system's differs between systems
    described = [
        {
            "@id": f"./{name}",
            "@type": "File",
            "name": name.rpartition("/")[2],
            "encodingFormat": kinds.guess_type(name)[0] or "application/octet-stream",
            "contentSize": str(len(content)),
            "sha256": sha256(content),
        }
        for name, content in sorted(files.items())
    ]
    crate = json.loads(read_text(__file__, "crate.json"))
    _, root, program, *_ = crate["@graph"]
    program["version"] = __version__
    parts = [{"@id": file["@id"]} for file in described]
    root |= {"name": title, "description": words, "datePublished": date, "hasPart": parts}
    crate["@graph"] += described
    return list_hashes({**files, CRATE: to_json(crate)})


def list_hashes(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Add the list of hashes to some files: of all but that list itself, and what signs it."""
    names = sorted(files.keys() - {SUMS, SIGNATURE})
    sums = [f"{sha256(files[name])}  {name}\n" for name in names]
    return {**files, SUMS: "".join(sums).encode()}


def pack(files: Mapping[str, bytes]) -> bytes:
    """Return the archive of some files."""
    return zip_files({ROOT + name: files[name] for name in sorted(files)}, zipfile.ZIP_STORED)


def zip_files(files: Mapping[str, bytes], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Put files into an archive in their order; the same files give the same bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", compression, compresslevel=9) as archive:
        for name, content in files.items():
            member = zipfile.ZipInfo(name, _EPOCH)
            member.create_system = 3  # as on Unix, on every system
            member.compress_type = compression
            archive.writestr(member, content)
    return packed.getvalue()


def is_bundle(path: str | os.PathLike[str]) -> bool:
    """Whether a bundle is meant: an archive, by its name or its end, or a folder."""
    place = Path(path)
    is_archive = place.is_file() and zipfile.is_zipfile(place)  # a pipe would be waited for
    return place.suffix == ".eln" or place.is_dir() or is_archive


def read_bundle(path: str | os.PathLike[str]) -> tuple[dict[str, bytes], list[str]]:
    """Read a bundle, or a folder that it was unpacked into.

    Returns
    -------
    files, faults
        Contents by name, and what was altered.

    Raises
    ------
    InputError
        It is something else, or too large.
    """
    place = Path(path)
    if place.is_dir():
        folder = place if (place / SUMS).exists() else place / ROOT
        paths = filter(Path.is_file, sorted(folder.rglob("*")))
        files = {each.relative_to(folder).as_posix(): _read(each) for each in paths}
    else:
        data = _read(place)
        files = _members(place, data)
    if SUMS not in files:
        raise _foreign(place, f"it has no {ROOT}{SUMS}")
    lists = (files[SUMS], list_hashes(files)[SUMS])
    rows, again = (text.decode("utf-8", "replace").splitlines() for text in lists)
    names = sorted({row.partition("  ")[2] for row in {*rows} ^ {*again}})
    faults = [f"{name} is not as {SUMS} has it" for name in names]
    faults = faults or [f"{SUMS} is not as rig writes it"] * (rows != again)
    # The archive has a checksum of each file too: an altered file shows around it as well.
    return files, faults if faults or place.is_dir() else _check_archive(files, data)


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
        is_inside = name.startswith(ROOT) and ".." not in name.split("/")
        if member.compress_type != zipfile.ZIP_STORED or not is_inside:
            raise _foreign(place, f"{name!r:.60} is compressed, or outside of {ROOT}")
        files[name.removeprefix(ROOT)] = data[begin : begin + member.compress_size]
    # Read as if bytes stood before all files, or some of them twice.
    if sum(map(len, files.values())) > len(data) or any(m.header_offset for m in members[:1]):
        raise _foreign(place, "its directory was altered")
    return files


def _check_archive(files: Mapping[str, bytes], data: bytes) -> list[str]:
    """Say where an archive differs from the one that its files give."""
    again = pack(files)
    if again == data:
        return []
    at = next((n for n, (a, b) in enumerate(zip(data, again, strict=False)) if a != b), len(again))
    with zipfile.ZipFile(io.BytesIO(again)) as archive:
        parts = {m.header_offset: f"the header of {m.filename}" for m in archive.infolist()}
        # The last time that a name stands there is in the directory, 46 bytes behind its entry.
        parts |= {
            again.rindex(name.encode()) - 46: f"its directory, at or behind {name}"
            for name in archive.namelist()
        }
    where = parts[max(begin for begin in parts if begin <= at)]
    return [f"the archive itself was altered at byte {at}, in {where}"]


def _read(path: Path) -> bytes:
    with errors_become("bundle_unreadable", OSError, path=path):
        data = read_input(path, _LARGEST + 1)
    if len(data) > _LARGEST:
        raise _foreign(path, f"it has more than {_LARGEST} bytes")
    return data


def _foreign(path: Path, text: str) -> RigError:
    return rig_error("bundle_foreign", path=path, text=text)

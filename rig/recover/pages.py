"""Reader of records from the raw pages of an SQLite file, which skips damaged records.

SQLite reads a table from its root page down, and loses all pages below a damaged page. Here every
page is read independently. The format is https://www.sqlite.org/fileformat2.html; comments refer to
its sections.
"""

import struct
from collections.abc import Iterator
from typing import TypeAlias

Value: TypeAlias = int | float | str | bytes | None
Cell: TypeAlias = tuple[int | None, tuple[Value, ...]]
"""Record and its number; `None` in an index, or in a table without row numbers."""

MAGIC = b"SQLite format 3\0"
_HEADER = 100  # bytes before the first page's b-tree, section 1.3
_USUAL_PAGE = 4096  # SQLite's default
TABLE_LEAF, INDEX_LEAF, INDEX_INTERIOR = 0x0D, 0x0A, 0x02
_SIZES = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8, 7: 8}  # serial type → bytes, section 2.1
_CONSTANTS = {0: None, 8: 0, 9: 1}  # serial type → value, same section


class Pages:
    """The pages of a database file.

    Attributes
    ----------
    known
        Whether the first page has SQLite's header.
    pages
        Existing pages, by number from 1.
    usable
        Bytes of a page that SQLite uses.
    expected
        Number of pages by the header; 0 if unknown.
    missing
        Number of missing pages.
    """

    def __init__(self, data: bytes) -> None:
        size = int.from_bytes(data[16:18], "big")
        size = 65536 if size == 1 else size
        if not data.startswith(MAGIC) or not 512 <= size <= 65536 or size & (size - 1):
            size = _USUAL_PAGE
        count = len(data) // size
        self.pages = {n + 1: data[n * size : (n + 1) * size] for n in range(count)}
        self.usable, self.expected = size, 0
        self.known = count > 0 and data.startswith(MAGIC)
        if self.known:
            # The rest may have been in a missing log; an absurd number is ignored.
            expected = self.header(28)
            self.expected = expected if expected < 4 * count + 1000 else 0
            self.usable -= data[20] if data[20] < size // 2 else 0
        self.missing = sum(n not in self.pages for n in range(1, self.expected + 1))

    def header(self, at: int) -> int:
        """Return the number at an offset of the file's header, section 1.3."""
        return int.from_bytes(self.pages.get(1, b"")[at : at + 4], "big")


def read_cells(pages: Pages, number: int) -> Iterator[Cell | None]:
    """Yield all records of a page, `None` for each unreadable one; none for other pages.

    Parameters
    ----------
    pages
        The database.
    number
        Number of the page.
    """
    page = pages.pages[number]
    start = _HEADER if number == 1 else 0
    kind = page[start]
    if kind not in {TABLE_LEAF, INDEX_LEAF, INDEX_INTERIOR}:
        return
    count = int.from_bytes(page[start + 3 : start + 5], "big")
    pointers = start + (12 if kind == INDEX_INTERIOR else 8)
    if pointers + 2 * count > pages.usable:
        yield None
        return
    for place in range(pointers, pointers + 2 * count, 2):
        try:
            yield _cell(pages, page, kind, int.from_bytes(page[place : place + 2], "big"))
        except (ValueError, LookupError):
            yield None


def _cell(pages: Pages, page: bytes, kind: int, at: int) -> Cell:
    """Read a cell, sections 1.6 and 2.1."""
    if kind == INDEX_INTERIOR:
        at += 4  # the page to its left
    size, at = _varint(page, at)
    rowid = None
    if kind == TABLE_LEAF:
        rowid, at = _varint(page, at)
    return rowid, tuple(_record(_payload(pages, page, kind, at, size)))


def _payload(pages: Pages, page: bytes, kind: int, at: int, size: int) -> bytes:
    """Return the bytes of a record from its page and its overflow pages."""
    usable = pages.usable
    limit = usable - 35 if kind == TABLE_LEAF else (usable - 12) * 64 // 255 - 23
    if size > len(pages.pages) * usable:
        raise ValueError("longer than the file")
    local, pointer = size, 0
    if size > limit:
        least = (usable - 12) * 32 // 255 - 23
        local, pointer = least + (size - least) % (usable - 4), 4
        local = local if local <= limit else least
    end = at + local
    if at < 8 or end + pointer > usable:
        raise ValueError("outside of its page")
    payload = bytearray(page[at:end])
    follow = page[end : end + pointer]
    while len(payload) < size:
        over = pages.pages[int.from_bytes(follow, "big")]
        payload += over[4 : min(4 + size - len(payload), usable)]
        follow = over[:4]
    return bytes(payload)


def _record(payload: bytes) -> Iterator[Value]:
    header, at = _varint(payload, 0)
    body = header
    while at < header:
        kind, at = _varint(payload, at)
        size = _SIZES.get(kind, max(0, kind - 12) // 2)
        data = payload[body : body + size]
        if kind in {10, 11} or len(data) != size:
            raise ValueError("of no such type, or cut short")
        body += size
        yield _value(kind, data)
    if at != header or body != len(payload):
        raise ValueError("of another length than it says")


def _value(kind: int, data: bytes) -> Value:
    if kind in _CONSTANTS:
        return _CONSTANTS[kind]
    if kind == 7:
        return float(struct.unpack(">d", data)[0])
    if kind < 7:
        return int.from_bytes(data, "big", signed=True)
    return data.decode("utf-8") if kind % 2 else data


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Return SQLite's number of variable length: 7 bits a byte, at most 9 bytes, big-endian."""
    value = 0
    for n in range(8):
        byte = data[at + n]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + n + 1
    value = value << 8 | data[at + 8]
    return value - (1 << 64) if value >> 63 else value, at + 9

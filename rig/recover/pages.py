"""The pages of a SQLite file, also of a torn one: read as bytes, without SQLite.

The format is https://www.sqlite.org/fileformat2.html; sections are given where they are used.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

MAGIC = b"SQLite format 3\0"
_HEADER = 100  # bytes before the first page's b-tree, section 1.3
_USUAL_PAGE = 4096  # what SQLite makes, unless told otherwise
_WAL_MAGIC = 0x377F0682  # section 4.1; its last bit chooses the byte order of the checksums
_WAL_HEADER = 32
_FRAME_HEADER = 24


@dataclass(frozen=True)
class Pages:
    """The pages of a database.

    Attributes
    ----------
    size
        Bytes a page.
    reserved
        Bytes at the end of each page that SQLite does not use.
    expected
        How many pages there should be, 0 when nobody says.
    pages
        Those that are there, by number from 1; the log's newer ones in place of the file's.
    committed
        Transactions that were in the log only.
    """

    size: int
    reserved: int
    expected: int
    pages: dict[int, bytes]
    committed: int

    @property
    def missing(self) -> int:
        """How many pages there should be and are not."""
        return sum(number not in self.pages for number in range(1, self.expected + 1))

    @property
    def usable(self) -> int:
        """Bytes of a page that SQLite uses."""
        return self.size - self.reserved

    def start(self, number: int) -> int:
        """Where the b-tree begins in a page."""
        return _HEADER if number == 1 else 0


def read_pages(data: bytes, log: bytes = b"") -> Pages:
    """Cut a database file into pages, with what its log holds beyond it.

    Parameters
    ----------
    data
        The file.
    log
        The ``-wal`` file beside it.
    """
    size = _page_size(data)
    pages = {
        number + 1: data[number * size : (number + 1) * size] for number in range(len(data) // size)
    }
    newer, committed, count = _newer(log, size)
    pages |= newer
    first = pages.get(1, b"")
    if not first.startswith(MAGIC):
        return Pages(size, 0, count, pages, committed)
    expected = count or int.from_bytes(first[28:32], "big")
    # A log that is not there may have held the rest; a wild number says nothing.
    if not 0 < expected < 4 * len(pages) + 1000:
        expected = 0
    return Pages(size, first[20] if first[20] < size // 2 else 0, expected, pages, committed)


def _page_size(data: bytes) -> int:
    size = int.from_bytes(data[16:18], "big")
    size = 65536 if size == 1 else size
    good = data.startswith(MAGIC) and 512 <= size <= 65536 and not size & (size - 1)
    return size if good else _USUAL_PAGE


def _newer(log: bytes, size: int) -> tuple[dict[int, bytes], int, int]:
    """Read the log up to its last whole commit: pages, transactions, size of the database then."""
    if len(log) < _WAL_HEADER:
        return {}, 0, 0
    magic, _, page_size, _, *salts = struct.unpack(">6I", log[:24])
    if magic & ~1 != _WAL_MAGIC or page_size != size:
        return {}, 0, 0
    words = ">" if magic & 1 else "<"
    sums = _checksum(words, log[:24], (0, 0))
    if sums != struct.unpack(">2I", log[24:32]):
        return {}, 0, 0
    done: dict[int, bytes] = {}
    waiting: dict[int, bytes] = {}
    committed = count = 0
    for at in range(_WAL_HEADER, len(log) - size - _FRAME_HEADER + 1, size + _FRAME_HEADER):
        header = log[at : at + _FRAME_HEADER]
        page = log[at + _FRAME_HEADER : at + _FRAME_HEADER + size]
        number, pages_then, *frame_salts = struct.unpack(">4I", header[:16])
        sums = _checksum(words, header[:8] + page, sums)
        if frame_salts != salts or sums != struct.unpack(">2I", header[16:24]):
            break  # what follows is of an older log, or torn
        waiting[number] = page
        if pages_then:
            done |= waiting
            waiting = {}
            committed, count = committed + 1, pages_then
    return done, committed, count


def _checksum(words: str, data: bytes, sums: tuple[int, int]) -> tuple[int, int]:
    """Go on with the log's running checksum, section 4.2."""
    one, two = sums
    for first, second in struct.iter_unpack(f"{words}2I", data):
        one = (one + first + two) & 0xFFFFFFFF
        two = (two + second + one) & 0xFFFFFFFF
    return one, two

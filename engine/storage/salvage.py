"""Reads a damaged SQLite file: every row of every page that makes sense by itself.

SQLite gives up where the tree that leads to a row is broken; here the pages are looked at one by one, and
those of the write-ahead log before those of the file. The file is only read, as bytes. The format is
https://www.sqlite.org/fileformat2.html (sections 1.5 to 2.1 and 4).

Why this is our own: SQLite's ``.recover`` is a command of its shell, not a function of a library. The shell
of Debian 12 (3.40) fails with it even on a sound run file, that of the APSW package (3.54) lacks it, and the
parser of dissect is under the AGPL.
"""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from engine.errors import RunFileError
from engine.storage.raw import raw_bytes

PAGE: Final = 4096
"""Bytes of a page of a run file."""
MAX_ROW: Final = 64 * 1024 * 1024
"""Largest plausible row, in bytes."""
_TABLE_LEAF, _INDEX_LEAF, _INDEX_INTERIOR = 0x0D, 0x0A, 0x02
_LOG_HEADER, _FRAME_HEADER = 32, 24
_LOG_MAGIC: Final = (0x377F0682, 0x377F0683)
_SIZES: Final = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8}
"""Bytes of an integer by its serial type."""


@dataclasses.dataclass(frozen=True, slots=True)
class Row:
    """One row.

    Attributes:
        rowid: its number; None in a table that has none, whose first columns are its key.
        values: of its columns as they are stored; the column that is an alias of the number is None.
    """

    rowid: int | None
    values: tuple[Any, ...]


@dataclasses.dataclass(slots=True)
class Salvage:
    """The rows of a file and what of it could not be read.

    Attributes:
        rows: in the order of their pages.
        n_pages: of the file, those of its log among them.
        n_missing: pages that the file's header counts but the file lacks.
        n_broken: cells of pages with rows that could not be read.
    """

    rows: list[Row]
    n_pages: int
    n_missing: int
    n_broken: int


class _Broken(Exception):
    """A page or a cell does not make sense."""


def salvage(path: Path) -> Salvage:
    """Read whatever rows a file still has.

    Raises:
        RunFileError: the file is missing or cannot be read at all.
    """
    try:
        content = raw_bytes(path)
        log = path.with_name(path.name + "-wal")
        frames = log.read_bytes() if log.exists() else b""
    except OSError as e:
        raise RunFileError(f"{path} cannot be read: {e.strerror}") from None
    pages = {i + 1: content[PAGE * i : PAGE * (i + 1)] for i in range(-(-len(content) // PAGE))}
    pages |= _logged(frames)
    promised = int.from_bytes(content[28:32], "big") if len(content) >= 100 else 0
    found = Salvage([], len(pages), 0, 0)
    # a damaged header may claim any size
    if promised < 2 * len(pages) + 1000:
        found.n_missing = max(0, promised - sum(len(p) == PAGE for p in pages.values()))
    for number in sorted(pages):
        _read_page(number, pages, found)
    return found


def _read_page(number: int, pages: dict[int, bytes], found: Salvage) -> None:
    page = pages[number].ljust(PAGE, b"\0")
    start = 100 if number == 1 else 0
    kind = page[start]
    if kind not in (_TABLE_LEAF, _INDEX_LEAF, _INDEX_INTERIOR):
        return
    pointers = start + (12 if kind == _INDEX_INTERIOR else 8)
    n = min(int.from_bytes(page[start + 3 : start + 5], "big"), (PAGE - pointers) // 2)
    for i in range(n):
        at = int.from_bytes(page[pointers + 2 * i : pointers + 2 * i + 2], "big")
        try:
            if at < pointers + 2 * n:
                raise _Broken
            found.rows.append(_cell(page, at, kind, pages))
        except (_Broken, struct.error, UnicodeDecodeError):
            found.n_broken += 1


def _cell(page: bytes, at: int, kind: int, pages: dict[int, bytes]) -> Row:
    if kind == _INDEX_INTERIOR:
        at += 4
    size, at = _varint(page, at)
    rowid = None
    if kind == _TABLE_LEAF:
        rowid, at = _varint(page, at)
        rowid -= (rowid >> 63) << 64
    if not 0 < size <= MAX_ROW:
        raise _Broken
    most = PAGE - 35 if kind == _TABLE_LEAF else (PAGE - 12) * 64 // 255 - 23
    if size <= most:
        payload = page[at : at + size]
    else:
        least = (PAGE - 12) * 32 // 255 - 23
        local = least + (size - least) % (PAGE - 4)
        local = local if local <= most else least
        payload = page[at : at + local]
        following = int.from_bytes(page[at + local : at + local + 4], "big")
        payload += b"".join(_overflow(following, size - local, pages))
    if len(payload) != size:
        raise _Broken
    return Row(rowid, _record(payload))


def _overflow(number: int, left: int, pages: dict[int, bytes]) -> Iterator[bytes]:
    while left > 0:
        page = pages.get(number, b"")
        part = page[4 : 4 + left]
        if len(part) < min(left, PAGE - 4):
            raise _Broken
        yield part
        left -= len(part)
        number = int.from_bytes(page[:4], "big")
    if number:
        raise _Broken  # the chain of another row


def _record(payload: bytes) -> tuple[Any, ...]:
    end, at = _varint(payload, 0)
    if not at <= end <= len(payload):
        raise _Broken
    kinds = []
    while at < end:
        kind, at = _varint(payload, at)
        kinds.append(kind)
    at, values = end, []
    for kind in kinds:
        value, at = _value(payload, at, kind)
        values.append(value)
    if at != len(payload):
        raise _Broken
    return tuple(values)


def _value(payload: bytes, at: int, kind: int) -> tuple[Any, int]:
    if kind in _SIZES:
        n = _SIZES[kind]
        return int.from_bytes(payload[at : at + n], "big", signed=True), at + n
    match kind:
        case 0:
            return None, at
        case 7:
            return struct.unpack_from(">d", payload, at)[0], at + 8
        case 8 | 9:
            return kind - 8, at
        case 10 | 11:
            raise _Broken
    n = (kind - 12) // 2
    content = payload[at : at + n]
    if len(content) != n:
        raise _Broken
    return content.decode() if kind % 2 else content, at + n


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for i in range(9):
        if at + i >= len(data):
            raise _Broken
        byte = data[at + i]
        if i == 8:
            return value << 8 | byte, at + 9
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + i + 1
    raise AssertionError


def _logged(log: bytes) -> dict[int, bytes]:
    """Return the pages that a write-ahead log holds: the newest of each that was committed."""
    if len(log) < _LOG_HEADER:
        return {}
    magic, _, size, _, salt_1, salt_2, sum_1, sum_2 = struct.unpack(">8I", log[:_LOG_HEADER])
    if magic not in _LOG_MAGIC or size != PAGE:
        return {}
    order = ">" if magic & 1 else "<"
    sums = _checksum(log[:24], (0, 0), order)
    if sums != (sum_1, sum_2):
        return {}
    committed: dict[int, bytes] = {}
    waiting: dict[int, bytes] = {}
    for at in range(_LOG_HEADER, len(log) - _FRAME_HEADER - PAGE + 1, _FRAME_HEADER + PAGE):
        number, n_after, *salts_and_sums = struct.unpack(">6I", log[at : at + _FRAME_HEADER])
        page = log[at + _FRAME_HEADER : at + _FRAME_HEADER + PAGE]
        sums = _checksum(page, _checksum(log[at : at + 8], sums, order), order)
        if tuple(salts_and_sums) != (salt_1, salt_2, *sums):
            break
        waiting[number] = page
        if n_after:
            committed |= waiting
            waiting = {}
    return committed


def _checksum(data: bytes, sums: tuple[int, int], order: str) -> tuple[int, int]:
    a, b = sums
    words = struct.unpack(f"{order}{len(data) // 4}I", data)
    for x, y in zip(words[::2], words[1::2], strict=True):
        a = (a + x + b) & 0xFFFFFFFF
        b = (b + y + a) & 0xFFFFFFFF
    return a, b

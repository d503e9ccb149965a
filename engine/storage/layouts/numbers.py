"""Whole numbers and bits as bytes, and back; the bytes may come from strangers."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.errors import InvalidData

MAX_VARINT: Final = 10
"""Bytes of the longest number: 70 bits."""


_SMALL: Final = [v >> 1 if v % 2 == 0 else -(v + 1 >> 1) for v in range(0x80)]
"""Numbers by what ``zigzag`` makes of them."""


def zigzag(value: int) -> int:
    """Return a whole number as one from 0: 0, -1, 1, -2 ... become 0, 1, 2, 3 ..."""
    return 2 * value if value >= 0 else -2 * value - 1


def varint(value: int) -> bytes:
    """Return a whole number from 0 in groups of seven bits, the lowest first; the last has no high bit.

    Raises:
        InvalidData: it has more than 70 bits.
    """
    found = bytearray()
    while value >= 0x80:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    if len(found) > MAX_VARINT:
        raise InvalidData("a whole number is too large to be stored")
    return bytes(found)


def pack_bits(bits: Sequence[bool] | np.ndarray) -> bytes:
    """Return bits as bytes, the first in the lowest place; the last byte is filled with zeros."""
    return np.packbits(np.asarray(bits, dtype=bool), bitorder="little").tobytes()


def inflate(content: bytes, most: int) -> bytes:
    """Undo raw deflate.

    Raises:
        InvalidData: it is damaged, or larger than ``most`` bytes.
    """
    unpacker = zlib.decompressobj(-15)
    try:
        found = unpacker.decompress(content, most)
    except zlib.error as e:
        raise InvalidData(f"compressed data is damaged: {e}") from None
    if not unpacker.eof or unpacker.unused_data:
        raise InvalidData("compressed data is cut short or too large")
    return found


class Bytes:
    """Reads bytes from the first to the last.

    Raises:
        InvalidData: from every method, if there are fewer bytes than asked for.
    """

    def __init__(self, content: bytes) -> None:
        self._content = content
        self._at = 0

    def take(self, n: int) -> bytes:
        """Return the next n bytes."""
        found = self._content[self._at : self._at + n]
        if len(found) != n:
            raise InvalidData("binary data is cut short")
        self._at += n
        return found

    def varint(self) -> int:
        """Return the next number that ``varint`` wrote."""
        value = 0
        for i in range(MAX_VARINT):
            (byte,) = self.take(1)
            value |= (byte & 0x7F) << 7 * i
            if byte < 0x80:
                return value
        raise InvalidData("a whole number in binary data is too large")

    def signed(self, n: int) -> list[int]:
        """Return the next n numbers that went through ``zigzag``."""
        found = self._content[self._at : self._at + n]
        if len(found) == n and not (n and max(found) >= 0x80):  # nearly always, and much faster
            self._at += n
            return [_SMALL[byte] for byte in found]
        values = [self.varint() for _ in range(n)]
        return [v >> 1 if v % 2 == 0 else -(v + 1 >> 1) for v in values]

    def bits(self, n: int) -> np.ndarray:
        """Return the next n bits that ``pack_bits`` wrote, (n,) bool."""
        packed = np.frombuffer(self.take(-(-n // 8)), np.uint8)
        return np.unpackbits(packed, count=n, bitorder="little").astype(bool)

    def rest(self) -> bytes:
        """Return all bytes that are left."""
        found = self._content[self._at :]
        self._at = len(self._content)
        return found

    def end(self) -> None:
        """Make sure that nothing is left.

        Raises:
            InvalidData: there are more bytes.
        """
        if self._at != len(self._content):
            raise InvalidData("binary data is longer than it says")

"""Files and texts of common formats: CSV, JSON, TOML and ZIP.

Equal content gives equal bytes. Files may come from strangers, so all that is read is checked.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import json
import math
import os
import re
import shutil
import stat
import struct
import tomllib
import uuid
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Final

from engine.errors import UNEXPECTED_DATA, InvalidData


def open_file(path: Path) -> BinaryIO:
    """Open a file for reading; a pipe or a device, whose reading may never end, is none.

    Raises:
        OSError: it cannot be opened, or is no regular file.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "it is no regular file")
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def write_files(files: Mapping[Path, str | bytes]) -> None:
    """Write files in one go: a full disk or an interruption leaves those that were there before as they were.

    Args:
        files: content by path, text as UTF-8; missing folders are made.

    Raises:
        OSError: one cannot be written; its ``filename`` is the path.
    """
    parts: dict[Path, Path] = {}
    try:
        for path, content in files.items():
            data = content.encode() if isinstance(content, str) else content
            try:
                where = path.resolve()  # what a link leads to is replaced, not the link
                if where.exists() and not where.is_file():
                    where.write_bytes(data)  # a pipe or /dev/null stays what it is
                    continue
                parts[where] = part = where.with_name(f".{uuid.uuid4().hex}.part")
                where.parent.mkdir(parents=True, exist_ok=True)
                with open(part, "xb") as f:
                    f.write(data)
                    f.flush()
                    os.fsync(f.fileno())
                if where.exists():
                    shutil.copymode(where, part)
            except FileExistsError:  # of the folders above, not of the file
                raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path)) from None
            except OSError as e:
                raise OSError(e.errno, e.strerror, str(path)) from None
            except RuntimeError:  # how Python tells of links that lead to each other
                raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path)) from None
        for where, part in parts.items():
            try:
                part.replace(where)
            except OSError as e:
                raise OSError(e.errno, e.strerror, str(where)) from None
    finally:
        for part in parts.values():
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV; every row ends its line, and None leaves a field empty.

    A spreadsheet would compute a text that begins like a formula, and it may be a stranger's: such a text
    gets an apostrophe before it. Numbers stay as they are, also those that are text already. Lines end alike.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([map(_inert, row) for row in rows])
    return text.getvalue()


def _inert(value: object) -> object:
    if not isinstance(value, str) or _NUMBER.fullmatch(value):
        return value
    return _FORMULA.sub(r"\1'", re.sub(r"\r\n?", "\n", value))


_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
_FORMULA: Final = re.compile(r"(^|[;\t]\s*)(?=[=+@\t\n-])")
"""Before what a spreadsheet takes for a formula, where a field begins: some take ``;`` for its end, too."""


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file that a user wrote.

    Raises:
        InvalidData: it cannot be read or is no TOML; the message names it.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as e:
        raise InvalidData(f"{path} cannot be read: {e.strerror or e}") from None
    except UnicodeDecodeError:
        raise InvalidData(f"{path} cannot be read: it is not UTF-8 text") from None
    return parse_toml(text, file=str(path))


def parse_toml(text: str, *, file: str) -> dict[str, Any]:
    """Read TOML text; ``file`` names it in messages.

    Raises:
        InvalidData: it is no TOML, or nested too deeply.
    """
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as e:
        raise InvalidData(f"{file}: not a TOML file: {e}") from None


def toml_text(values: Mapping[str, Any]) -> str:
    """Return values as TOML: numbers, texts and lists of them, and tables of these.

    Equal values give equal text, and floats survive the trip exactly.
    """
    return "\n".join(_toml_lines(values, ())) + "\n"


def _toml_lines(values: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    for key, value in values.items():
        if not isinstance(value, Mapping):
            yield f"{key} = {json.dumps(value, ensure_ascii=False, allow_nan=False)}"
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield ""
            yield f"[{'.'.join((*path, key))}]"
            yield from _toml_lines(value, (*path, key))


_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, RuntimeError, *UNEXPECTED_DATA)
"""Errors that ``zipfile`` raises for damaged archives."""


def zip_bytes(files: Mapping[str, bytes], folder_name: str = "") -> bytes:
    """Return a ZIP archive of files, in one folder or in none; equal files give equal bytes.

    Args:
        files: content by name.
        folder_name: of the one folder at the archive's top; empty for none.
    """
    buffer = io.BytesIO()
    prefix = f"{folder_name}/" if folder_name else ""
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(prefix + name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, whatever system this runs on
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name])
    return buffer.getvalue()


def read_zip(content: bytes, limits: Mapping[str, int]) -> dict[str, bytes]:
    """Return the files of a ZIP archive by name.

    Args:
        content: the archive.
        limits: the names that it must hold, and no others, with the largest size of each, in bytes.

    Raises:
        InvalidData: it is no ZIP archive, is damaged, or holds other or larger files.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = {entry.filename: entry for entry in archive.infolist()}
            if set(entries) != set(limits) or len(archive.infolist()) != len(limits):
                raise InvalidData(f"it must hold exactly {', '.join(sorted(limits))}")
            files = {}
            for name, entry in entries.items():
                if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                    raise InvalidData(f"{name} is packed in an unknown way")
                with archive.open(entry) as f:
                    files[name] = f.read(limits[name] + 1)
                    if len(files[name]) > limits[name]:
                        raise InvalidData(f"{name} is too large")
            return files
    except _DAMAGE as e:
        raise InvalidData(f"it is damaged: {e}") from None


def readable_json(value: Any) -> str:
    """Return JSON for people and programs; a number that is not finite is null."""

    def finite(part: Any) -> Any:
        match part:
            case dict():
                return {k: finite(v) for k, v in part.items()}
            case list() | tuple():
                return [finite(v) for v in part]
            case float() if not math.isfinite(part):
                return None
        return part

    return json.dumps(finite(value), indent=2, allow_nan=False)


def compact_json(value: Any) -> str:
    """Return compact JSON; floats survive the trip exactly."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)

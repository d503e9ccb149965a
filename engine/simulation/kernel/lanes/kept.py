"""Compiled code on disk, which is loaded only if it is whole.

Numba keeps an index of signatures and a file of code for each. Here every file of code begins with a digest
of the rest: code of which a byte has changed would be run as it is. What is damaged is removed, so that it is
compiled and kept anew. A folder belongs to one version of the sources, wherever they lie, so that the place
and the age of the source files, by which Numba goes, do not matter.
"""

from __future__ import annotations

import contextlib
import contextvars
import hashlib
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

_DIGEST: Final = 32
"""Bytes of a SHA-256 digest."""
_loading_only: Final = contextvars.ContextVar("loading_only", default=False)


class NotKeptError(Exception):
    """Something would have to be compiled."""


def is_kept(call: Callable[[], object]) -> bool:
    """Whether all compiled code that a call needs is loaded or can be loaded; what is damaged is removed."""
    token = _loading_only.set(True)
    try:
        call()
    except NotKeptError:
        return False
    finally:
        _loading_only.reset(token)
    return True


class KeptCode(FunctionCache):
    """What one entry point compiles to.

    Args:
        function: the entry point.
        folder: of its version.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        with _cache_dir(folder):
            super().__init__(function)
        self._cache_path = str(folder)
        self._cache_file = _CheckedFile(self._cache_path, self._impl.filename_base, None)

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            found = super()._load_overload(sig, target_context)
        except OSError:
            found = None
        if found is None and _loading_only.get():
            raise NotKeptError
        return found

    def _save_overload(self, sig: Any, data: Any) -> None:
        # a full disk costs the next process time, this one nothing
        if self._impl.check_cachable(data):
            key, content = self._index_key(sig, data.codegen), self._impl.reduce(data)
            with contextlib.suppress(OSError):
                self._cache_file.save(key, content)


class _CheckedFile(IndexDataCacheFile):
    """Index and code of one entry point; what is damaged counts as missing."""

    def _load_index(self) -> dict[Any, str]:
        try:
            index = super()._load_index()
            return {key: str(name) for key, name in index.items()}
        except OSError:
            raise
        except Exception:  # a damaged pickle may raise anything
            Path(self._index_path).unlink(missing_ok=True)
            return {}

    def _load_data(self, name: str) -> Any:
        path = Path(self._data_path(name))
        content = path.read_bytes()
        if hashlib.sha256(content[_DIGEST:]).digest() != content[:_DIGEST]:
            path.unlink(missing_ok=True)
            raise FileNotFoundError(path)
        return pickle.loads(content[_DIGEST:])

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        with self._open_for_write(self._data_path(name)) as f:
            f.write(hashlib.sha256(content).digest() + content)


@contextlib.contextmanager
def _cache_dir(folder: Path) -> Iterator[None]:
    """Let Numba use a folder, not one beside the sources, which may not be writable."""
    config: Any = numba.config
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = before

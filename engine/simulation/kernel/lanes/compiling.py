"""How the kernel is compiled, and where the result is kept.

Compiling takes about 20 s for each entry point and number of lanes, so what Numba makes of an entry point
is kept on disk (``kept``). Numba notices a change in the file of an entry point, not in the functions that it
calls. The folder's name is therefore a digest of the entry point's module, of all modules of the kernel that
it imports, of the versions of Python, Numba and LLVM, and of the processor; inside, Numba tells the types of
the arguments apart, and with them the number of lanes. A folder that cannot be written only costs time.
``engine.simulation.compile_kernel`` compiles all that the product uses.

Compiled code must take no number from a module of another package: a change there would not be noticed.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import os
import platform
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import llvmlite
import numba
from llvmlite import binding
from numba import njit

from engine.simulation.kernel.lanes.kept import KeptCode

CACHE_VARIABLE: Final = "TENSATLAS_CACHE"
"""Environment variable that names another folder than the user's cache folder."""

_KERNEL: Final = __name__.rsplit(".", 2)[0]
_FOLDER: Final = Path(__file__).parents[1]
"""The package whose modules make up the kernel, and its folder."""

_OPTIONS: Final[dict[str, Any]] = {"error_model": "numpy", "nogil": True}
"""A division by zero gives infinity as everywhere else in the kernel; the interpreter is not needed."""

inlined: Final[Callable[..., Any]] = njit(forceinline=True, **_OPTIONS)
"""Compiles a small function into its callers."""
compiled: Final[Callable[..., Any]] = njit(**_OPTIONS)
"""Compiles a function of its own."""


def entry_point(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, and keep it on disk if that is possible."""
    dispatcher: Any = njit(function, **_OPTIONS)
    folder = cache_folder(Path(function.__code__.co_filename))
    if folder is not None:
        dispatcher._cache = KeptCode(function, folder)
    return dispatcher


def cache_folder(source: Path, root: Path = _FOLDER) -> Path | None:
    """Return the folder of what a module compiles to, made if need be; None if it cannot be written.

    Args:
        source: the module's file.
        root: folder of the kernel's modules.
    """
    folder = _user_cache() / f"kernel-{_digest(source, root)}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return None


def _user_cache() -> Path:
    """Return the program's folder among the user's caches, as the operating system has them."""
    if chosen := os.environ.get(CACHE_VARIABLE):
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", "~/AppData/Local")).expanduser() / "tensatlas" / "Cache"
    if sys.platform == "darwin":
        return Path("~/Library/Caches/tensatlas").expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "tensatlas"


def _digest(source: Path, root: Path) -> str:
    """Return a digest of everything that a module's code hangs on, apart from the types of arguments."""
    digest = hashlib.sha256()
    for version in (platform.python_version(), numba.__version__, llvmlite.__version__, *_processor()):
        digest.update(version.encode())
    for path in sorted(_imported(source, root, set())):
        name = path.relative_to(root).as_posix() if path.is_relative_to(root) else path.name
        digest.update(name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def _processor() -> tuple[str, str]:
    """Return name and features of the processor for which Numba compiles."""
    config: Any = numba.config
    name, features = config.CPU_NAME, config.CPU_FEATURES
    if name in (None, "host") and features is None:
        return binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    return str(name), str(features)


def _imported(source: Path, root: Path, found: set[Path]) -> set[Path]:
    """Return a module's file and those of all modules of the kernel that it imports, directly or not."""
    if source in found or not source.is_file():
        return found
    found.add(source)
    for name in _imports(source.read_bytes()):
        place = root.joinpath(*name.split("."))
        _imported(place.with_name(f"{place.name}.py"), root, found)
    return found


@functools.cache  # the entry points share nearly all of their modules
def _imports(code: bytes) -> tuple[str, ...]:
    """Return what code imports of the kernel by name, from its package on, modules and what is in them."""
    found: list[str] = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and node.module and f"{node.module}.".startswith(f"{_KERNEL}."):
            module = node.module.removeprefix(_KERNEL)
            found += (module, *(f"{module}.{alias.name}" for alias in node.names))
    return tuple(found)

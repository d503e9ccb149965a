"""The sketch compiled for this computer: a board whose clock goes as fast as somebody wants."""

from __future__ import annotations

import importlib.resources
import shutil
import struct
import subprocess
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from types import TracebackType
from typing import Final, Self

import numpy as np

from engine.errors import InvalidData

COMPILERS: Final = ("c++", "g++", "clang++")
FLAGS: Final = ("-std=c++11", "-O1")


def compiler() -> str | None:
    """Return the C++ compiler of this computer, None if it has none."""
    return next((path for name in COMPILERS if (path := shutil.which(name))), None)


def compile_board(files: Mapping[str, bytes], folder: Path) -> Path:
    """Compile a sketch with the stand-in for Arduino's headers.

    Args:
        files: of the sketch, by name.
        folder: empty, for the sketch and the program.

    Returns:
        The program.

    Raises:
        InvalidData: there is no compiler, or it does not take the sketch.
    """
    program = compiler()
    if program is None:
        raise InvalidData(
            "a simulated board needs a C++ compiler; install one, such as with: sudo apt install g++"
        )
    for name, content in files.items():
        (folder / PurePosixPath(name).name).write_bytes(content)
    made = folder / "board"
    with importlib.resources.as_file(importlib.resources.files("engine") / "data/firmware/board") as board:
        command = [program, *FLAGS, f"-I{board}", f"-I{folder}", str(board / "board.cpp"), "-o", str(made)]
        done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        said = [line for line in done.stderr.splitlines() if "error" in line] or ["no reason given"]
        raise InvalidData(f"the sketch cannot be compiled: {said[0]}")
    return made


class HostBoard:
    """A board that runs a sketch on this computer; to be used in a ``with`` block.

    Args:
        program: that ``compile_board`` made.
        n_servos: how many the sketch drives.
    """

    def __init__(self, program: Path, n_servos: int) -> None:
        self._n = n_servos
        self._process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.greeting, self.pulses = self._answer()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait(timeout=10)

    def advance(self, milliseconds: int, received: bytes = b"") -> bytes:
        """Let time pass, and return what the board prints meanwhile; ``pulses`` are those at its end.

        Args:
            milliseconds: how much.
            received: what has come over the serial line at the beginning.

        Raises:
            InvalidData: the program has ended.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(struct.pack("=II", milliseconds, len(received)) + received)
            self._process.stdin.flush()
        except BrokenPipeError:
            raise InvalidData("the sketch's program has ended") from None
        printed, self.pulses = self._answer()
        return printed

    def _answer(self) -> tuple[bytes, np.ndarray]:
        """Return what was printed, and the (servos,) pulses in microseconds."""
        (n,) = struct.unpack("=I", self._read(4))
        printed = self._read(n)
        return printed, np.frombuffer(self._read(4 * self._n), dtype="=u4").astype(float)

    def _read(self, n: int) -> bytes:
        assert self._process.stdout is not None
        found = self._process.stdout.read(n)
        if len(found) < n:
            raise InvalidData("the sketch's program has ended")
        return found

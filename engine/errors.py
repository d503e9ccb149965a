"""Errors whose message is meant for the person at the keyboard: one line that says what to do."""

import os
import shlex
from pathlib import Path
from typing import Final

MAX_LINE: Final = 1000
"""Longest message, in characters; a longer one loses its middle, because its end says what to do."""


def one_line(text: str) -> str:
    """Return a text without line breaks and control characters, shortened if it is very long."""
    text = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    if len(text) > MAX_LINE:
        text = f"{text[: MAX_LINE - 305]} ... {text[-300:]}"
    return text


def printable(text: str) -> str:
    """Return a name for people and for pages: what is no visible character, as ``~`` and hex digits.

    The name of a file may be any bytes; Python holds those that are no text as surrogates.
    """

    def shown(c: str) -> str:
        code = ord(c)
        if 0xDC80 <= code <= 0xDCFF:
            return f"~{code - 0xDC00:02x}"
        return "".join(f"~{byte:02x}" for byte in c.encode(errors="surrogatepass"))

    return "".join(c if c.isprintable() else shown(c) for c in text)


def as_typed(path: Path) -> str:
    """Return a path as one types it in a shell."""
    text = str(path)
    if text.isprintable():
        return shlex.quote(text)
    escaped = (chr(b) if 32 <= b < 127 and b not in b"\\'" else f"\\x{b:02x}" for b in os.fsencode(path))
    return f"$'{''.join(escaped)}'"


class TensAtlasError(Exception):
    """Base of every error that the user can mend; the command line prints it and exits with 2.

    The message is always one line of sensible length, even if it quotes a stranger's file.

    Args:
        message: for the user.
    """

    def __init__(self, message: object = "") -> None:
        super().__init__(one_line(str(message)))


UNEXPECTED_DATA = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)
"""What reading data of an unexpected form may raise."""


class Cancelled(Exception):
    """Ends a computation whose result is no longer wanted; its caller catches it."""


class InvalidData(TensAtlasError):
    """A genotype, configuration or file holds an invalid value."""


class UnknownTask(InvalidData):
    """A run, a dump or the user names a task that is neither built in nor in a file that the user named."""


class TaskError(TensAtlasError):
    """A user's task file cannot be read, has an error, or its task returns invalid values."""


class RunFileError(TensAtlasError):
    """A run file is missing, damaged, foreign, newer than this program or in use."""


class DamagedRunFile(RunFileError):
    """A run file that is damaged or partly lost; the message says how to save the rest.

    Args:
        path: of the file.
        problem: what is wrong with it, as a predicate: ``is damaged: ...``.
    """

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(
            f"{path} {problem}; save what is whole with: tensatlas recover {as_typed(path)} --out NEW.tsmr"
        )


class DumpError(TensAtlasError):
    """A failure dump is missing, damaged, foreign or newer than this program, or cannot be written."""


class ExportError(TensAtlasError):
    """A solution cannot be exported, or the export cannot be written where it was asked for."""


class ClusterError(TensAtlasError):
    """Workers cannot be started or reached, or are not fit for a run."""

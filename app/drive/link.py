"""The serial line to the board."""

from __future__ import annotations

import errno
import os
from typing import Any

from engine.errors import InvalidData
from engine.fabrication.firmware.protocol import BAUD

INSTALL = "pip install 'tensatlas[drive]'"


class Link:
    """A serial line, as lines of text.

    Args:
        port: its name, such as /dev/ttyUSB0 or COM3.

    Raises:
        InvalidData: there is no such port, it cannot be opened, or pySerial is not installed.
    """

    def __init__(self, port: str) -> None:
        try:
            import serial
        except ImportError:
            raise InvalidData(f"a serial line needs pySerial; install it with: {INSTALL}") from None
        self.port = port
        self._error: type[Exception] = serial.SerialException
        self._received = b""
        try:
            self._serial: Any = serial.Serial(port, BAUD, timeout=0, write_timeout=1)
        except (serial.SerialException, ValueError, OSError) as e:
            raise InvalidData(
                f"port {port} cannot be opened: {_reason(e)}; the board's is among: {_ports()}"
            ) from None

    def lines(self) -> list[str]:
        """Return the lines that have come since the last call.

        Raises:
            InvalidData: the line is broken.
        """
        try:
            while new := self._serial.read(4096):
                self._received += new
        except (self._error, OSError) as e:
            raise InvalidData(f"the board at {self.port} is gone: {_reason(e)}") from None
        *whole, self._received = self._received.split(b"\n")
        # rubbish without an end, such as of another speed
        self._received = self._received[-1000:]
        return [text for line in whole if (text := line.decode("ascii", "replace").strip())]

    def send(self, line: str) -> None:
        """Send a line.

        Raises:
            InvalidData: the line is broken.
        """
        try:
            self._serial.write(line.encode("ascii") + b"\n")
        except (self._error, OSError) as e:
            raise InvalidData(f"the board at {self.port} is gone: {_reason(e)}") from None

    def close(self) -> None:
        """Close it."""
        self._serial.close()


def _reason(error: Exception) -> str:
    """Return why a port fails, without what pySerial puts around it."""
    cause = error.__context__
    number = getattr(error, "errno", None)
    if not isinstance(number, int) and cause is not None and cause.args:
        number = cause.args[0]  # termios says why, with a number of the system's
    if number == errno.ENOTTY:
        return "it is no serial port"
    return os.strerror(number) if isinstance(number, int) else str(error)


def _ports() -> str:
    from serial.tools.list_ports import comports

    return ", ".join(sorted(p.device for p in comports())) or "none found; is it plugged in?"

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAPS = """
import ctypes, sys, threading
from engine.workers.malloc import keep_memory_compact

if sys.argv[1] == "compact":
    assert keep_memory_compact()
meet = threading.Barrier(12)

def work():
    meet.wait()
    kept = [bytearray(2000) for _ in range(2000)]
    meet.wait()

threads = [threading.Thread(target=work) for _ in range(12)]
for t in threads:
    t.start()
for t in threads:
    t.join()
library = ctypes.CDLL(None)
library.fopen.restype = ctypes.c_void_p
file = ctypes.c_void_p(library.fopen(sys.argv[2].encode(), b"w"))
library.malloc_info(0, file)
library.fclose(file)
print(open(sys.argv[2]).read().count("<heap nr="))
"""


def heaps(how: str, folder: Path) -> int:
    """Return how many heaps a process has whose twelve threads allocated at once."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("MALLOC_", "GLIBC_"))}
    done = subprocess.run(
        [sys.executable, "-c", HEAPS, how, str(folder / "info.xml")],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    return int(done.stdout)


@pytest.mark.skipif(not hasattr(os, "confstr") or not sys.platform.startswith("linux"), reason="of glibc")
def test_threads_share_two_heaps(tmp_path: Path) -> None:
    assert heaps("compact", tmp_path) <= 2 < heaps("as it is", tmp_path)

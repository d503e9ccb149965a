"""``python -m app`` is ``tensatlas``, of the folder that this package lies in."""

import runpy
from pathlib import Path

if __name__ == "__main__":
    runpy.run_path(str(Path(__file__).resolve().parents[1] / "tensatlas.py"), run_name="__main__")

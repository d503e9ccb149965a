"""The command ``tensatlas``, and how its processes start others: ``python -P tensatlas.py ...``.

The packages are called ``app``, ``engine`` and ``viz``, as somebody else's may be. From here on these names
mean the ones beside this file, whatever lies in the current folder or in ``PYTHONPATH``. This module's own
name is one that nobody else has, and it imports nothing of the project before that.
"""

import importlib.abc
import importlib.machinery
import os
import runpy
import sys
from collections.abc import Sequence
from types import ModuleType

ROOT = os.path.dirname(os.path.abspath(__file__))  # noqa: PTH100, PTH120  # pathlib would delay each start
PACKAGES = ("app", "engine", "viz")
INTERRUPTED = 130
USAGE_ERROR = 2


class OurPackages(importlib.abc.MetaPathFinder):
    """Finds the project's packages beside this file, and nothing else."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return where a package of the project is."""
        if path is not None or name not in PACKAGES:
            return None
        return importlib.machinery.PathFinder.find_spec(name, [ROOT], target)


def pin() -> None:
    """Let the packages' names mean ours from now on; exit in a line if one has another's already."""
    for name in PACKAGES:
        known = sys.modules.get(name)
        where = None if known is None else getattr(known, "__file__", None) or "an unknown place"
        if where is not None and os.path.dirname(os.path.dirname(os.path.abspath(where))) != ROOT:  # noqa: PTH100, PTH120
            sys.stderr.write(
                f"tensatlas: a package called {name!r} in {os.path.dirname(where)} was imported before"  # noqa: PTH120
                f" TensAtlas's own in {ROOT}; rename it, or start TensAtlas without it\n"
            )
            sys.exit(USAGE_ERROR)
    if not any(isinstance(finder, OurPackages) for finder in sys.meta_path):
        sys.meta_path.insert(0, OurPackages())


def main() -> None:
    """Run the command; as ``-m MODULE ...`` a module of the project, for one of its processes."""
    try:
        pin()
        # nothing is drawn by MuJoCo, which would look for a window system, in a process of its own
        os.environ.setdefault("MUJOCO_GL", "disable")
        if sys.argv[1:2] == ["-m"]:
            del sys.argv[:2]
            runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
            return
        from app.cli.main import main as run
    except KeyboardInterrupt:  # while modules are imported
        sys.exit(INTERRUPTED)
    except ImportError as error:  # as which a compiled module may report it
        if isinstance(error.__cause__ or error.__context__, KeyboardInterrupt):
            sys.exit(INTERRUPTED)
        raise
    run()


if __name__ == "__main__":
    main()

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from app.maps.shared_scale import SharedScale
from app.runs.library import Library
from engine.storage.reader import RunReader
from tests.support.run_formats import change
from viz.maps.contents import load_contents
from viz.maps.scale import color_limits


def test_a_scale_for_all_runs_of_a_task_holds_the_values_of_all(
    small_run: Path, grid_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for run in (small_run, grid_run):
        shutil.copy(run, tmp_path / run.name)
    # both are of the same robots: let those of one run be 10 cm better
    change(tmp_path / grid_run.name, "UPDATE evaluations SET fitness = fitness - 0.1")
    (tmp_path / "damaged.tsmr").write_text("no run")
    library = Library([tmp_path])
    try:
        values, alone = [], []
        for name in (small_run.name, grid_run.name):
            with RunReader(tmp_path / name) as reader:
                contents = load_contents(reader, reader.generations()[-1])
                found = [e.f_s for content in contents.values() for e in content.elites.values()]
                values += found
                alone.append(color_limits(found))
        shared = SharedScale(library)
        readers = [library.reader((tmp_path / run.name).resolve()) for run in (small_run, grid_run)]
        assert [shared.limits(reader) for reader in readers] == [color_limits(values)] * 2
        assert color_limits(values) not in alone
    finally:
        library.close()

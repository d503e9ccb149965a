import json
import sys

import numpy as np
import pytest

from engine.analysis.elite_table import elite_table, write_table
from engine.body.morphology import Morphology
from engine.errors import ExportError, RunFileError
from engine.storage.reader import RunReader
from engine.storage.writer import RunWriter
from tests.support.made_up_grid import AXES, random_grid_run


@pytest.fixture
def tables(small_run, tmp_path):
    """A real run's elites as CSV and as Parquet, and in memory."""
    with RunReader(small_run) as reader:
        table = elite_table(reader)
    for name in ("elites.csv", "elites.parquet"):
        write_table(table, tmp_path / "deep" / name)
    return table, tmp_path / "deep" / "elites.csv", tmp_path / "deep" / "elites.parquet"


def test_a_row_for_every_elite(small_run, tables):
    table = tables[0]
    with RunReader(small_run) as reader:
        last = reader.generations()[-1]
        held = {n: reader.contents(n, last.number) for n in last.archives}
    assert len(table["index"]) == sum(map(len, held.values()))
    rows = [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]
    for row in rows:
        cell = tuple(map(int, row["cell"].split(",")))
        e = held[row["archive"]].pop(cell)
        assert row["index"] == cell[0] * 10 + cell[1]
        assert row["objective"] == pytest.approx(45.0 - 100 * e.fitness)
        assert row["evaluation"] == e.solution.number
        assert Morphology.from_json(json.loads(row["solution_morphology"])) == e.solution.morphology
        assert json.loads(row["solution_controller"]) == e.solution.controller.to_json()
        if row["archive"] == "morphology":
            assert row["measures_0"] == e.solution.morphology.n_modules
            assert row["measures_1"] == e.solution.morphology.stiffness
    assert not any(held.values())


def test_measures_lie_in_their_cells(small_run, tables):
    table = tables[0]
    with RunReader(small_run) as reader:
        axes = {n: f.axes for n, f in reader.generations()[-1].archives.items()}
    columns = (table[c] for c in ("archive", "cell", "measures_0", "measures_1"))
    components = []
    for name, cell, *measures in zip(*columns, strict=True):
        for axis, i, value in zip(axes[name], map(int, cell.split(",")), measures, strict=True):
            width = (axis.upper - axis.lower) / axis.n
            assert axis.lower + i * width <= value < axis.lower + (i + 1) * width
            if name == "controller":
                components.append((value - axis.lower) / width % 1)
    # values of the components themselves, not of the cells' centres
    assert np.std(components) > 0.1


def test_pyribs_reads_it_and_draws_its_heatmap(small_run, tables):
    """The columns are pyribs': its own archive takes the elites back into the same cells."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt
    import pandas as pd
    from ribs.archives import ArchiveDataFrame, GridArchive
    from ribs.visualize import grid_archive_heatmap

    table, csv_path, parquet_path = tables
    frame = pd.read_csv(csv_path)
    assert list(frame["objective"]) == table["objective"]
    pd.testing.assert_frame_equal(frame, pd.read_parquet(parquet_path), check_dtype=False)
    with RunReader(small_run) as reader:
        last = reader.generations()[-1]
    for name, figures in last.archives.items():
        df = ArchiveDataFrame(frame[frame["archive"] == name])
        archive = GridArchive(
            solution_dim=(),
            dims=[a.n for a in figures.axes],
            ranges=[(a.lower, a.upper) for a in figures.axes],
            solution_dtype=object,
        )
        added = archive.add(
            solution=df.get_field("solution_morphology"),
            objective=df.get_field("objective"),
            measures=df.get_field("measures"),
        )
        assert (added["status"] == 2).all()  # every one found an empty cell
        theirs = archive.data(return_type="pandas").sort_values("index")
        assert list(theirs["index"]) == sorted(df["index"])
        assert archive.stats.coverage == pytest.approx(figures.coverage)
        assert archive.stats.qd_score == pytest.approx(100 * figures.qd_score, rel=1e-4)
        plt.figure()
        grid_archive_heatmap(archive)
        drawn = plt.gca().collections[0].get_array()
        assert np.ma.count(np.ma.masked_invalid(drawn)) == len(df)
        plt.figure()
        grid_archive_heatmap(archive, df=df)  # from our table alone
        again = plt.gca().collections[0].get_array()
        np.testing.assert_allclose(np.ma.filled(drawn, 0), np.ma.filled(again, 0), rtol=1e-5)
        plt.close("all")


def test_one_archive_has_no_columns_of_others(tmp_path):
    path = random_grid_run(tmp_path / "grid.tsmr")
    with RunReader(path) as reader:
        table = elite_table(reader, "grid")
        cells = reader.placements("grid", 2)
    assert [c for c in table if c.startswith("measures")] == [f"measures_{i}" for i in range(4)]
    assert table["index"] == [int(np.ravel_multi_index(c, [a.n for a in AXES])) for c in sorted(cells)]
    # the run keeps no PCA: the components are given by their cells' centres
    first = sorted(cells)[0]
    assert table["measures_2"][0] == pytest.approx(-4.5 + first[2] + 0.5)


def test_bad_input_is_refused_in_a_line(small_run, tables, tmp_path, monkeypatch):
    with (
        RunReader(small_run) as reader,
        pytest.raises(RunFileError, match="has no grid archive, but controller"),
    ):
        elite_table(reader, "grid")
    with RunWriter.create(tmp_path / "new.tsmr", reader.config, {}):
        pass
    with (
        RunReader(tmp_path / "new.tsmr") as reader,
        pytest.raises(RunFileError, match="no finished generation"),
    ):
        elite_table(reader)
    table = tables[0]
    with pytest.raises(ExportError, match=r"ends in \.csv or \.parquet"):
        write_table(table, tmp_path / "elites.xlsx")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(ExportError, match="cannot be written"):
        write_table(table, tmp_path / "folder.csv")

    monkeypatch.setitem(sys.modules, "pyarrow", None)  # as if it were not installed
    with pytest.raises(ExportError, match=r"pip install 'tensatlas\[parquet\]'"):
        write_table(table, tmp_path / "elites.parquet")

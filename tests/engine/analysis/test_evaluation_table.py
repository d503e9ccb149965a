"""Every evaluation as a table, and genotypes back from it."""

import json

import pandas as pd
import pytest

from engine.analysis.elite_table import elite_table, write_table
from engine.analysis.evaluation_table import evaluation_table, read_genotypes
from engine.errors import InvalidData
from engine.storage.reader import RunReader
from tests.support.run_formats import change


@pytest.fixture
def table(small_reader):
    return evaluation_table(small_reader)


def test_a_row_for_every_evaluation(small_reader, table):
    everything = list(small_reader.each_evaluation())
    assert table["evaluation"] == list(range(18))
    for k, (generation, e) in enumerate(everything):
        row = {name: values[k] for name, values in table.items()}
        assert row.pop("objective") == pytest.approx(45.0 - 100.0 * e.fitness)
        assert json.loads(row.pop("solution_morphology")) == e.solution.morphology.to_json()
        assert json.loads(row.pop("solution_controller")) == e.solution.controller.to_json()
        assert row == {
            "evaluation": k,
            "generation": generation,
            "parent": e.solution.parent,
            "operator": e.solution.operator,
            "source": e.solution.source,
            "measures_0": e.solution.morphology.n_modules,
            "measures_1": e.solution.morphology.stiffness,
            "head_is_end": e.head_is_end,
            "failure": None,
        }


def test_an_evaluation_that_failed_has_no_objective(small_run, tmp_path):
    path = tmp_path / "run.tsmr"
    path.write_bytes(small_run.read_bytes())
    change(path, "UPDATE evaluations SET fitness = NULL, failure = '=cmd|x' WHERE number = 17")
    with RunReader(path) as reader:
        table = evaluation_table(reader)
    assert (table["objective"][17], table["failure"][17]) == (None, "=cmd|x")
    write_table(table, tmp_path / "all.csv")
    assert pd.read_csv(tmp_path / "all.csv")["failure"][17] == "'=cmd|x"


def test_a_run_without_an_evaluation_has_a_table_without_a_row(small_config, tmp_path):
    from engine.storage.writer import RunWriter

    with RunWriter.create(tmp_path / "run.tsmr", small_config, {}):
        pass
    with RunReader(tmp_path / "run.tsmr") as reader:
        table = evaluation_table(reader)
    write_table(table, tmp_path / "all.csv")
    assert read_genotypes(tmp_path / "all.csv") == []


@pytest.mark.parametrize("name", ["all.csv", "all.parquet"])
def test_genotypes_come_back_from_a_table(small_reader, table, tmp_path, name):
    write_table(table, tmp_path / name)
    expected = [(e.solution.morphology, e.solution.controller) for _, e in small_reader.each_evaluation()]
    assert read_genotypes(tmp_path / name) == expected
    # pandas writes it in its own way; an elite table has the same columns
    pd.read_csv(tmp_path / name).to_csv(tmp_path / "again.csv") if name.endswith("csv") else None
    elites = elite_table(small_reader, "morphology")
    write_table(elites, tmp_path / f"elites-{name}")
    found = read_genotypes(tmp_path / f"elites-{name}")
    assert found == [expected[n] for n in elites["evaluation"]]


def test_what_pandas_has_written_is_read(small_reader, table, tmp_path):
    write_table(table, tmp_path / "all.csv")
    pd.read_csv(tmp_path / "all.csv").to_csv(tmp_path / "again.csv", encoding="utf-8-sig")
    assert read_genotypes(tmp_path / "again.csv") == read_genotypes(tmp_path / "all.csv")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("solution_morphology", "{", "is no genotype"),
        ("solution_morphology", None, "is no genotype"),
        ("solution_morphology", '{"stiffness_level": 3, "faces": [1]}', "number of modules must be"),
        ("solution_controller", "[]", "a controller needs exactly"),
        ("solution_controller", '{"n_inputs": 2, "nodes": [], "connections": []}', "needs each output node"),
        ("solution_controller", "[" * 100_000, "is no genotype"),
    ],
)
def test_a_broken_genotype_is_named_by_row_and_column(table, tmp_path, suffix, column, value, said):
    table[column][4] = value
    path = tmp_path / f"broken{suffix}"
    write_table(table, path)
    with pytest.raises(InvalidData, match=rf"broken\{suffix}, row 5, column {column}: .*{said}") as e:
        read_genotypes(path)
    assert "\n" not in str(e.value)


def test_what_is_no_such_table_is_refused(tmp_path):
    for name, content, said in (
        ("empty.csv", b"", "has no column solution_morphology"),
        ("other.csv", b"solution_morphology,x\n1,2\n", "has no column solution_controller"),
        ("binary.csv", b"\xff\xfe\x00", "is no table"),
        ("zero.csv", b"solution_morphology,solution_controller\n\0,1\n", "row 1|is no table"),
        ("text.parquet", b"text", "cannot be read"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InvalidData, match=rf"{name}.*({said})"):
            read_genotypes(tmp_path / name)
    for name in ("gone.csv", "gone.parquet"):
        with pytest.raises(InvalidData, match=rf"{name} cannot be read"):
            read_genotypes(tmp_path / name)

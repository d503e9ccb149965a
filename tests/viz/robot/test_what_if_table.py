from __future__ import annotations

import re

import numpy as np
import pytest

from engine.body.morphology import with_face, with_modules
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.robot.what_if_table import compare, render_genes, render_table, scores_at


def test_the_originals_way_is_compared_second_by_second(small_reader: RunReader) -> None:
    config, e = small_reader.config, small_reader.evaluation(2)
    assert np.array_equal(scores_at(config, e, 2), e.distances)  # the end
    then = scores_at(config, e, 1)
    assert then.shape == (4, 1)
    # a robot moves little in the last second
    assert then[:, 0] == pytest.approx(e.distances[:, 0], abs=0.05)
    assert not np.array_equal(then, e.distances)


def test_changes_have_a_sign_and_a_colour(small_reader: RunReader) -> None:
    config, e = small_reader.config, small_reader.evaluation(2)
    f_s, *targets = compare(config, e, e.distances - 0.01, 2)
    assert f_s.original == pytest.approx(100 * (get_task(config.task).target_distance - e.fitness))
    assert f_s.change == pytest.approx(1.0)
    assert f_s.is_better
    assert all(t.is_better and t.change == pytest.approx(-1.0) for t in targets)
    table = render_table([f_s, *targets], "after <1> s", "it <diverged>")
    assert "+1.0" in table
    assert "-1.0" in table
    assert "<diverged>" not in table
    assert "after <1>" not in table
    waiting = compare(config, e, None, 2)
    assert all(line.variant is None and line.change is None for line in waiting)


def test_every_gene_can_be_clicked(small_reader: RunReader) -> None:
    body = small_reader.evaluation(2).solution.morphology
    changed = with_modules(with_face(body, 0, body.faces[0] % 8 + 1), 10)
    genes = set(re.findall(r'data-c="face:(\d+),(\d+)"', render_genes(changed, body, "")))
    assert genes == {(str(m), str(f)) for m in range(10) for f in range(1, 9)}

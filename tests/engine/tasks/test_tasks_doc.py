"""The page that teaches tasks is true."""

import re
from pathlib import Path

from engine.tasks import Task, View, load_task, loading
from tests.support.made_up import a_view

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "tasks.md").read_text()


def test_the_page_s_example_works(tmp_path, monkeypatch):
    monkeypatch.setattr(loading, "_loaded", {})
    (source,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    path = tmp_path / "straight.py"
    path.write_text(source)
    task = load_task(path)
    view = a_view(position=(0.2, -0.05), direction=(1, 0), target=(1.0, 0.0))
    # f_s is the way ahead less the way aside
    assert abs(task.target_distance - task.score(view)[0, 0] - 0.15) < 1e-12


def test_the_page_names_every_field_and_everything_that_is_seen():
    fields = [f for f in Task.__dataclass_fields__ if f != "file"]
    seen = [n for n in [*vars(View), "time"] if not n.startswith("_")]
    assert len(fields) == 13
    assert len(seen) >= 10
    assert [n for n in [*fields, *seen] if not re.search(rf"`[^`]*\b{n}\b[^`]*`", PAGE)] == []

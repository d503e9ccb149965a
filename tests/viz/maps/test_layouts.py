"""Which maps show an archive with the feet as an axis."""

from types import SimpleNamespace

from engine.search.trajectory_archive import morphology_axes
from viz.maps import axis_labels
from viz.maps.layouts import NESTED, PROJECTED, layouts

AXES = morphology_axes("shared", feet=True)


def test_feet_are_shown_as_a_map_for_each_kind() -> None:
    found = layouts({"morphology": AXES})
    (nested,) = found[NESTED]
    assert [AXES[a].name for a in nested.axes] == ["feet", "modules", "stiffness"]
    content = SimpleNamespace(elites={(2, 7, 1): "this", (2, 7, 2): "other"})
    shown = nested.cells(content, None)  # type: ignore[arg-type]
    assert shown == {(1, 2, 7): (2, 7, 1), (2, 2, 7): (2, 7, 2)}
    assert nested.cell_of((2, 7, 1), None) == (1, 2, 7)
    # by modules and stiffness, and by modules and feet
    assert [v.axes for v in found[PROJECTED]] == [(0, 1), (0, 2)]
    per_module = morphology_axes("per-module")
    assert layouts({"morphology": per_module})[NESTED][0].axes == (0, 1, 2)


def test_kinds_of_feet_have_names() -> None:
    assert [text for _, text in axis_labels.ticks(AXES[2])] == ["none", "start", "end"]
    assert axis_labels.describe(AXES, (0, 2, 1)) == (
        "2 modules, relative stiffness 0.3 (35 N/m), feet toward the start"
    )
    assert axis_labels.newtons_per_metre(AXES[2]) is None

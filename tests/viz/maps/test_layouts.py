"""Which maps show an archive with the feet as an axis."""

from types import SimpleNamespace

from engine.search.axes import Axis
from engine.search.body_space import BodySpace
from viz.maps import axis_labels
from viz.maps.layouts import BY_BODY, NESTED, PROJECTED, layouts

AXES = BodySpace(feet_axis=True).axes


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
    per_module = BodySpace(stiffness="per-module").axes
    assert layouts({"morphology": per_module})[NESTED][0].axes == (0, 1, 2)


def test_a_grid_of_bodies_feet_and_ways_is_shown_by_the_best() -> None:
    axes = (*AXES, Axis("PCA 1", -4.0, 4.0, 9), Axis("PCA 2", -5.0, 5.0, 10))
    found = layouts({"grid": axes})
    assert list(found) == [PROJECTED, BY_BODY]
    views = found[PROJECTED]
    assert [v.axes for v in views] == [(0, 1), (0, 2), (3, 4)]
    assert [v.title(axes, None) for v in views] == [
        "Morphology map, projected",
        "Morphology map by feet",
        "Controller map, projected",
    ]
    weak, strong = (SimpleNamespace(f_s=f, number=n) for f, n in ((1.0, 4), (9.0, 5)))
    content = SimpleNamespace(elites={(2, 7, 1, 0, 3): weak, (2, 7, 2, 0, 3): strong, (2, 7, 2, 1, 1): weak})
    body, feet, way = (v.cells(content, None) for v in views)  # type: ignore[arg-type]
    assert body == {(2, 7): (2, 7, 2, 0, 3)}
    assert feet == {(2, 1): (2, 7, 1, 0, 3), (2, 2): (2, 7, 2, 0, 3)}
    assert way == {(0, 3): (2, 7, 2, 0, 3), (1, 1): (2, 7, 2, 1, 1)}
    # within a body with its feet
    _, inner = found[BY_BODY]
    assert inner.cells(content, (2, 7, 2)) == {  # type: ignore[arg-type]
        (0, 3): (2, 7, 2, 0, 3),
        (1, 1): (2, 7, 2, 1, 1),
    }
    assert inner.cell_of((2, 7, 1, 0, 3), (2, 7, 2)) is None


def test_kinds_of_feet_have_names() -> None:
    assert [text for _, text in axis_labels.ticks(AXES[2])] == ["none", "start", "end"]
    assert axis_labels.describe(AXES, (0, 2, 1)) == (
        "2 modules, relative stiffness 0.3 (35 N/m), feet toward the start"
    )
    assert axis_labels.newtons_per_metre(AXES[2]) is None

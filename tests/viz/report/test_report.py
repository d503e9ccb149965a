from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest

from engine.analysis.comparison import Comparison, TaskComparison, compare_runs
from engine.analysis.comparison.measures import MEASURES, number
from engine.analysis.comparison.run_result import Robust, RunResult
from engine.analysis.comparison.task_comparison import make_groups
from engine.config import replaced
from viz import theme
from viz.report.maps import maps_figure, task_scale
from viz.report.nested import nested_figure
from viz.report.report import render_page, report_sections, style
from viz.report.style import DARK, LIGHT, colors
from viz.report.tables import (
    p_value,
    runs_table,
    settings_table,
    significance_table,
    statistics_table,
)
from viz.report.trends import ends_figure, profile_figure, trend_figure


@pytest.fixture(scope="module")
def result(small_run: Path) -> RunResult:
    """A real run of DM-ME."""
    return compare_runs([small_run]).tasks[0].runs[0]


@pytest.fixture(scope="module")
def comparison(result: RunResult) -> Comparison:
    """Runs as of all three algorithms: one of ViE-NEAT, six of MAP-Elites, five of DM-ME."""

    def as_run(k: int, algorithm: str) -> RunResult:
        config = dataclasses.replace(result.config, algorithm=algorithm, seed=k)
        points = tuple(
            dataclasses.replace(p, best=(p.best or 0.0) + 0.001 * k, qd_score=p.qd_score + 0.01 * k)
            for p in result.points
        )
        maps = dict(result.maps)
        if algorithm == "vie-neat":
            maps = {"morphology": maps["morphology"]}
        return dataclasses.replace(
            result, config=config, path=Path(f"{algorithm}-{k}"), points=points, maps=maps
        )

    runs = [as_run(0, "vie-neat"), *(as_run(k, "map-elites") for k in range(1, 7))]
    runs += [as_run(k, "dm-me") for k in range(7, 12)]
    task = TaskComparison("goal-reaching", make_groups(runs))
    return Comparison((task,), {r.path: r.path.name for r in runs}, ("a <note> & more",))


@pytest.fixture(scope="module")
def single(comparison: Comparison) -> Comparison:
    """One run of each algorithm."""
    (task,) = comparison.tasks
    groups = tuple(dataclasses.replace(g, runs=g.runs[:1]) for g in task.groups)
    return dataclasses.replace(comparison, tasks=(TaskComparison(task.task, groups),))


def heatmaps(figure: go.Figure) -> list[go.Heatmap]:
    """Return the maps of a figure, without what marks empty cells."""
    return [t for t in figure.data if t.type == "heatmap" and t.coloraxis]


def titles(figure: go.Figure) -> list[str]:
    return [a.text for a in figure.layout.annotations]


def test_maps_lie_in_the_papers_arrangement(comparison: Comparison) -> None:
    figure = maps_figure(comparison.tasks[0], comparison.labels, LIGHT)
    rows = [t.replace("<br>", " ") for t in titles(figure) if t.startswith("<b>")]
    assert rows == [
        "<b>ViE-NEAT</b> morphology (reconstructed)",
        "<b>MAP-Elites</b> morphology",
        "<b>MAP-Elites</b> morphology",  # the sixth run begins another row
        "<b>DM-ME</b> morphology",
        "<b>MAP-Elites</b> controller",
        "<b>MAP-Elites</b> controller",
        "<b>DM-ME</b> controller",
    ]
    assert len(heatmaps(figure)) == 1 + 2 * 6 + 2 * 5
    assert figure.layout.width <= 1080


def test_single_runs_lie_beside_each_other_by_algorithm(single: Comparison) -> None:
    figure = maps_figure(single.tasks[0], single.labels, LIGHT)
    assert [t for t in titles(figure) if t.startswith("<b>")] == [
        "<b>morphology maps</b>",
        "<b>controller maps</b>",
    ]
    assert titles(figure)[0] == "ViE-NEAT (reconstructed)"
    by_column = {m.xaxis: m for m in heatmaps(figure)}
    assert set(by_column) == {"x", "x2", "x3", "x5", "x6"}  # ViE-NEAT has no controller map


def test_a_map_shows_every_elite_where_it_belongs(result: RunResult, comparison: Comparison) -> None:
    task = TaskComparison("goal-reaching", make_groups([result]))
    morphology, controller = heatmaps(maps_figure(task, {result.path: "run"}, LIGHT))
    for drawn, name in ((morphology, "morphology"), (controller, "controller")):
        shown = result.maps[name]
        z = np.array(drawn.z, dtype=float)
        assert z.shape == (10, 9)
        assert np.isfinite(z).sum() == len(shown.elites)
        for (i, j), (fitness, n) in shown.elites.items():
            assert z[j, i] == pytest.approx(45.0 - 100.0 * fitness)
            assert f"robot {n}" in drawn.text[j][i]


def test_all_maps_of_a_task_share_one_scale(comparison: Comparison) -> None:
    task = comparison.tasks[0]
    scale = task_scale(task)
    nested = nested_figure(task, task.groups[2].runs, comparison.labels, LIGHT)
    for figure in (maps_figure(task, comparison.labels, LIGHT), nested):
        axis = figure.layout.coloraxis
        assert (axis.cmin, axis.cmax) == (scale.low, scale.high)
        # the colours of the app, where 0 is grey if values lie on both sides of it
        assert scale.about_zero
        for part, color in axis.colorscale:
            assert color == scale.color(scale.low + part * (scale.high - scale.low))
        assert theme.STILL in [color for _, color in axis.colorscale]
        assert [scale.part(v) for v in axis.colorbar.tickvals] == pytest.approx(list(scale.ticks()))
    best = max(100.0 * v for r in task.runs for v in r.maps["morphology"].values(0.45).values())
    assert scale.low < best <= scale.high


def test_nested_map_has_a_block_for_every_body(result: RunResult) -> None:
    task = TaskComparison("goal-reaching", make_groups([result]))
    figure = nested_figure(task, [result], {result.path: "a<b>"}, LIGHT)
    (drawn,) = heatmaps(figure)
    z = np.array(drawn.z, dtype=float)
    assert z.shape == (10 * 11 - 1, 9 * 10 - 1)
    grid = result.maps["grid"]
    assert np.isfinite(z).sum() == len(grid.elites)
    for (a, b, c, d), (fitness, _) in grid.elites.items():
        assert z[b * 11 + d, a * 10 + c] == pytest.approx(45.0 - 100.0 * fitness)
    assert "a&lt;b&gt;" in titles(figure)[0]
    assert figure.layout.xaxis.ticktext == tuple("2 3 4 5 6 7 8 9 10".split())


def test_trends_have_a_mean_and_a_band_for_every_algorithm(comparison: Comparison) -> None:
    task = comparison.tasks[0]
    figure = trend_figure(task, ("best",), LIGHT)
    named = {t.name: t for t in figure.data if t.showlegend}
    assert list(named) == [
        "ViE-NEAT (1 run)",
        "MAP-Elites (6 runs, mean ± s.d.)",
        "DM-ME (5 runs, mean ± s.d.)",
    ]
    bands = [t for t in figure.data if t.fill == "toself"]
    assert len(bands) == 2  # a single run has none
    expected = task.groups[1].trend("best")
    assert np.array_equal(named["MAP-Elites (6 runs, mean ± s.d.)"].y, expected.mean)
    upper = np.array(bands[0].y)[: len(expected.mean)]
    np.testing.assert_allclose(upper - expected.mean, expected.std)
    assert expected.std[-1] == pytest.approx(0.1 * np.std(range(1, 7), ddof=1))


def test_the_trend_of_squeezing_has_the_line_of_its_aperture(comparison: Comparison) -> None:
    task = comparison.tasks[0]
    assert not trend_figure(task, ("best",), LIGHT).layout.shapes
    squeezing = dataclasses.replace(task, task="squeezing")
    (line,) = trend_figure(squeezing, ("best",), LIGHT).layout.shapes
    assert line.y0 == line.y1 == pytest.approx(15.17, abs=0.005)  # as the paper says
    assert not trend_figure(squeezing, ("qd_score", "coverage"), LIGHT).layout.shapes


def test_the_profile_counts_cells_above_any_limit(result: RunResult) -> None:
    robust = Robust(4, (0.10, 0.02, -0.01), {})
    group = make_groups([dataclasses.replace(result, robust=robust)])
    figure = profile_figure(TaskComparison("goal-reaching", group), LIGHT)
    trend, ends, fresh = [t for t in figure.data if t.mode in ("lines", "markers")]
    values = 100.0 * np.array(list(result.maps["morphology"].values(0.45).values()))
    assert trend.y[-1] == (values > 0.7925).sum()
    for k in (0, 60, 120, 199):
        assert ends.y[k] == (values > ends.x[k]).sum()
    assert fresh.line.dash == "dot"
    # 10, 2 and -1 cm
    assert [fresh.y[int(np.searchsorted(fresh.x, at))] for at in (0.5, 2.5, 9.5)] == [2, 1, 1]
    assert fresh.y[-1] == 0


def test_ends_show_every_run_and_the_published_mean(comparison: Comparison) -> None:
    figure = ends_figure(comparison.tasks[0], LIGHT)
    published = [t for t in figure.data if t.legendgroup == "published"]
    assert [t.x[0] for t in published[:3]] == [26.21, 22.16, 25.76]
    assert sum(t.showlegend for t in published) == 1
    dots = [len(t.y) for t in figure.data if t.mode == "markers" and t.legendgroup != "published"]
    assert dots == [1, 6, 5] * 2


def test_variants_get_colours_of_their_own() -> None:
    names = ["DM-ME", "DM-ME, cell capacity 50", *"abcdefgh"]
    assert len(set(colors(names).values())) == 10
    assert colors(["DM-ME"])["DM-ME"] == colors(names)["DM-ME"]


def test_numbers_for_people() -> None:
    assert number(-1234.567, 1) == "−1,234.6"
    assert number(None, 2) == "—"
    # a mean of counts may not be whole
    assert [MEASURES["above"].text(v) for v in (1234.0, 2.5, None)] == ["1,234", "2.5", "—"]
    assert MEASURES["offset_qd_score"].text(2.6) == "3"
    assert p_value(0.000157) == "0.0002"
    assert p_value(1e-9) == "< 0.0001"


def test_tables(comparison: Comparison) -> None:
    task = comparison.tasks[0]
    cells = re.findall(r"<td[^>]*>(.*?)</td>", statistics_table(task, "best"))
    row = cells[len(cells) // 3 :][: len(cells) // 3]
    s = task.groups[1].statistics("best")
    assert s is not None
    assert s.std is not None
    assert row[1:4] == ["6", number(s.mean, 2), number(s.std, 2)]
    assert row[-5:] == ["22.16", "4.13", "15.40", "29.14", "21.50"]
    assert "published" not in statistics_table(task, "coverage")
    assert runs_table(task, comparison.labels).count("<tr>") == 1 + 12
    tested = significance_table(task)
    assert "1 run of ViE-NEAT and 6 runs of MAP-Elites are too few" in tested
    assert ">DM-ME is higher<" in tested
    assert ">no difference shown<" in tested
    few = TaskComparison("goal-reaching", tuple(dataclasses.replace(g, runs=g.runs[:2]) for g in task.groups))
    assert significance_table(few).count("too few runs to say which group is better") == 1
    alone = TaskComparison("goal-reaching", task.groups[:1])
    assert "a single group" in significance_table(alone)
    assert settings_table(alone) == ""


def test_a_table_says_what_groups_differ_in(result: RunResult) -> None:
    config = replaced(result.config, seed=5, batch_size=8, sensory="displacements")
    groups = make_groups([result, dataclasses.replace(result, config=config)])
    cells = re.findall(r"<td[^>]*>(.*?)</td>", settings_table(TaskComparison("goal-reaching", groups)))
    assert cells == [
        *("batch_size", str(result.config.map_search.batch_size), "8"),
        *("sensory", "positions", "displacements"),
    ]


def test_the_page_stands_alone(single: Comparison) -> None:
    sections = report_sections(single)
    page = render_page(single, sections)
    assert "a &lt;note&gt; &amp; more" in page
    assert not re.search(r'<(script|link|img)[^>]*(src|href)="http', page)
    for section in sections:
        assert page.count(f'<section id="{section.name}"') == 1
        for figure in section.figures:
            assert page.count(f'<figure id="{figure.name}"') == 1


def test_pictures_come_first_and_what_single_runs_do_not_say_last(
    comparison: Comparison, single: Comparison
) -> None:
    parts = [s.name.removeprefix("goal-reaching-") for s in report_sections(comparison)]
    assert parts == ["notes", "trends", "maps", "nested", "results", "runs"]
    maps = next(s for s in report_sections(single) if s.name.endswith("-maps")).figures[0].caption
    assert "It has no controller map, because it describes no movements" in maps
    others = dataclasses.replace(single, tasks=(TaskComparison("goal-reaching", single.tasks[0].groups[1:]),))
    assert "ViE-NEAT" not in report_sections(others)[2].figures[0].caption


def test_the_app_gets_the_same_sections_in_its_own_colours(single: Comparison) -> None:
    light, dark = report_sections(single), report_sections(single, DARK)
    assert [s.name for s in dark] == [s.name for s in light]
    assert [s.name for s in light] == [
        "notes",
        *(f"goal-reaching-{s}" for s in ("trends", "maps", "nested", "runs", "results")),
    ]
    figure = dark[1].figures[0].figure
    assert figure.layout.paper_bgcolor == "rgba(0,0,0,0)"
    assert figure.layout.font.color == DARK.ink
    assert "#" not in style()  # the style sheet takes the colours around it

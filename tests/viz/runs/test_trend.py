from __future__ import annotations

import json
from typing import cast
from xml.etree import ElementTree

from engine.analysis.profile import Profile, ProfileHistory
from engine.storage.rows import ArchiveFigures, Generation
from viz import words
from viz.runs import trend


def figures(best: float | None, qd_score: float) -> ArchiveFigures:
    mean = None if best is None else best / 2
    return ArchiveFigures(best=best, mean=mean, qd_score=qd_score, coverage=0.25, axes=())


class History:
    """Profiles of made-up generations: as many good cells as the generation's number says."""

    threshold = 0.0079

    def get(self, number: int, _: str) -> Profile:
        return Profile(above=number, offset_qd_score=2.0)


def render(generations: list[Generation], shown: int | None = None) -> str:
    return trend.render(generations, cast(ProfileHistory, History()), shown)


def generation(number: int, best: float | None, *others: str) -> Generation:
    return Generation(
        number=number,
        n_evaluations=10 * (number + 1),
        n_failed=0,
        archives=dict.fromkeys(("morphology", *others), figures(best, 0.1 * number)),
        seconds=1.0,
    )


def lines(svg: str) -> list[list[tuple[float, float]]]:
    return [
        [(float(x), float(y)) for x, y in (p.split(",") for p in e.attrib["points"].split())]
        for e in ElementTree.fromstring(svg).iter("polyline")
    ]


def text(svg: str) -> str:
    return "".join(ElementTree.fromstring(svg).itertext())


def test_six_lines_run_over_all_generations_and_rise_upwards() -> None:
    drawn = lines(render([generation(k, 0.01 * k) for k in range(5)], 4))
    assert [len(line) for line in drawn] == [5] * 6
    for line in drawn:
        assert [x for x, _ in line] == sorted({x for x, _ in line})
    for line in (*drawn[:3], drawn[4]):
        assert [y for _, y in line] == sorted({y for _, y in line}, reverse=True)
    for line in (drawn[3], drawn[5]):  # coverage and the score with offset stay
        assert len({y for _, y in line}) == 1


def test_titles_give_the_values_of_the_shown_generation() -> None:
    svg = render([generation(k, 0.01 * k) for k in range(5)], 3)
    for part in (
        "best fs  3.00 cm",
        "mean fs  1.50 cm",
        "QD score 30 cm",
        "coverage 25 %",
        "cells above 0.79 cm 3",
        "QD with offset 200 cm",
    ):
        assert part in text(svg)
    for sentence in (words.F_S, words.QD_SCORE, words.COVERAGE):
        assert words.plain(sentence) in text(svg)


def test_every_archive_has_its_line_and_the_legend_says_whose_it_is() -> None:
    svg = render([generation(k, 0.01 * k, "controller", "<i>") for k in range(3)])
    assert len(lines(svg)) == 12
    assert "controller" not in text(svg)  # the first two by name, the map of bodies before all
    svg = render([generation(k, 0.01 * k, "controller") for k in range(3)])
    assert "● morphology  ● controller" in text(svg)


def test_the_pointer_reads_the_values_of_each_drawn_generation() -> None:
    root = ElementTree.fromstring(render([generation(k, 0.01 * k) for k in range(900)]))
    rows = json.loads(root.attrib["data-points"])
    assert len(rows) == trend.MAX_POINTS
    assert rows[0][0] == 0
    assert rows[-1][0] == trend.PLOT_WIDTH
    assert rows[-1][1].startswith("generation 899, 9,000 evaluations\nbest f_s 899.00 cm\n")
    assert rows[-1][1].endswith("\ncells above 0.79 cm 899\nQD with offset 200 cm")
    assert len(root.attrib["data-plots"].split(";")) == 6


def test_nothing_yet_is_said() -> None:
    svg = render([generation(0, None)])
    assert not lines(svg)
    assert "begin" in text(svg)


def test_one_generation_and_constant_values_can_be_drawn() -> None:
    svg = render([generation(0, 0.02)], 0)
    assert [len(line) for line in lines(svg)] == [1] * 6
    assert len(list(ElementTree.fromstring(svg).iter("circle"))) == 6
    assert len(lines(render([generation(k, 0.0) for k in range(3)]))) == 6

from __future__ import annotations

from xml.etree import ElementTree

from engine.reader import ArchiveFigures, Generation
from viz import trend


def generation(number: int, best: float | None) -> Generation:
    figures = ArchiveFigures(best=best, mean=best, qd_score=0.1 * number, coverage=0.1, axes=())
    return Generation(
        number=number,
        n_evaluations=10 * (number + 1),
        n_failed=0,
        archives={"morphology": figures},
        seconds=1.0,
    )


def lines(svg: str) -> list[list[tuple[float, float]]]:
    return [
        [(float(x), float(y)) for x, y in (p.split(",") for p in e.attrib["points"].split())]
        for e in ElementTree.fromstring(svg).iter("polyline")
    ]


def test_both_lines_run_over_all_generations_and_rise_upwards() -> None:
    best, qd = lines(trend.render([generation(k, 0.01 * k) for k in range(5)], "morphology", 4))
    assert len(best) == len(qd) == 5
    assert [x for x, _ in best] == sorted({x for x, _ in best})
    assert [y for _, y in best] == sorted({y for _, y in best}, reverse=True)


def test_nothing_yet_is_said() -> None:
    svg = trend.render([generation(0, None)], "morphology")
    assert not lines(svg)
    assert "begins" in "".join(ElementTree.fromstring(svg).itertext())


def test_one_generation_and_constant_values_can_be_drawn() -> None:
    assert len(lines(trend.render([generation(0, 0.02)], "morphology", 0))) == 2
    assert len(lines(trend.render([generation(k, 0.0) for k in range(3)], "morphology"))) == 2

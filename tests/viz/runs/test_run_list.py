from __future__ import annotations

from html.parser import HTMLParser

from viz.runs.run_list import RunFacts, arranged, render_choices, render_chosen, render_list


class Buttons(HTMLParser):
    """Collects tags and the text of each button."""

    def __init__(self, markup: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.texts: dict[str, str] = {}
        self._in: str | None = None
        self.feed(markup)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        if tag == "button":
            self._in = dict(attrs)["data-c"] or ""
            self.texts[self._in] = ""

    def handle_endtag(self, tag: str) -> None:
        if tag == "button":
            self._in = None

    def handle_data(self, data: str) -> None:
        if self._in is not None:
            self.texts[self._in] += data


def test_a_list_says_what_each_run_is_and_how_far_it_came() -> None:
    done = RunFacts(task="squeezing", algorithm="vie-neat", n_evaluations=600, best=0.0523, state="finished")
    live = RunFacts(task="goal-reaching", algorithm="map-elites", n_evaluations=0, state="live")
    lost = RunFacts(problem="lost.tsmr is <cut> short")
    found = Buttons(render_list([("done", done), ("live", live), ("lost", lost)], 0, "go()"))
    assert found.texts == {
        "run:0": "done5.23 cmsqueezing · vie-neat · 600 evaluations · finished",
        "run:1": "livegoal-reaching · map-elites · 0 evaluations · ● live",
        "run:2": "lostlost.tsmr is <cut> short",
    }


def test_names_of_files_and_what_is_in_them_cannot_inject_markup() -> None:
    evil = "<script>alert(1)</script>"
    facts = RunFacts(task=evil, algorithm=evil, state="stopped")
    for markup in (render_list([(evil, facts)], None, "go()"), render_chosen(evil, 1, True, "go()")):
        found = Buttons(markup)
        assert "script" not in found.tags
        assert any(evil in text for text in found.texts.values())


def test_any_number_of_runs_can_be_chosen_but_none_with_a_problem() -> None:
    run = RunFacts(task="squeezing", algorithm="vie-neat", n_evaluations=600)
    markup = render_choices([("<a>", run), ("b", run), ("lost", RunFacts(problem="cut short"))], {1}, "go()")
    found = Buttons(markup)
    assert set(found.texts) == {"all:0", "none:0", "run:0", "run:1", "run:2"}
    assert "a" not in found.tags
    assert "1 of 3 runs chosen" in markup
    states = [part.split(">")[0] for part in markup.split('role="checkbox"')[1:]]
    assert [('aria-checked="true"' in s, "disabled" in s) for s in states] == [
        (False, False),
        (True, False),
        (False, True),
    ]


def test_a_list_of_many_runs_is_searched_and_sorted() -> None:
    runs = [
        ("b", RunFacts(task="squeezing", algorithm="dm-me", best=0.02, date="2026-11-03", state="finished")),
        (
            "a",
            RunFacts(
                task="goal-reaching", algorithm="dm-me", best=0.05, date="2026-11-01", note="the good one"
            ),
        ),
        ("broken", RunFacts(problem="damaged")),
        ("c", RunFacts(task="goal-reaching", algorithm="vie-neat", date="2026-11-09")),
    ]

    def labels(search: str = "", order: str = "name") -> list[str]:
        return [label for label, _ in arranged(runs, search, order)]

    assert labels() == labels(order="nonsense") == ["b", "a", "broken", "c"]
    assert labels(order="best f_s") == ["a", "b", "broken", "c"]
    assert labels(order="newest") == ["c", "b", "a", "broken"]
    assert labels(order="task") == ["broken", "a", "c", "b"]
    assert labels("GOOD one") == ["a"]
    assert labels("dm-me finished") == ["b"]
    assert "the good one</i>" in render_list(runs, None, "js()")

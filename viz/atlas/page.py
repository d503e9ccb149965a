"""All elites of a run, simulated again, as one HTML file that opens without a server."""

from __future__ import annotations

import html
import importlib.resources
import urllib.parse
from collections.abc import Callable, Collection, Mapping
from typing import Final

from engine.analysis.comparison.groups import ALGORITHM_NAMES
from engine.config import task_of
from engine.errors import InvalidData, printable
from engine.replay.every_target import replay_every_target
from engine.search.archive import cell_name
from engine.storage.reader import RunReader
from engine.tasks import remaining_distance
from viz import words
from viz.atlas.elites import pack_elite, updates_per_frame
from viz.atlas.shown import Shown, what_to_show
from viz.maps import axis_labels
from viz.maps.interaction import SCRIPT
from viz.maps.map_pictures import MapPicture
from viz.recording.standalone_replay import json_text, own_file, page

MAX_LINK: Final = 500
AGAIN: Final = (
    "The elites were evaluated again, under noise that they were not selected with. The mean of that, ± its"
    " standard deviation, stands first on a robot's card and colours the maps as “robust fitness”: a robot"
    " can be expected to do it again. The recorded figures favour the lucky."
)
SAME: Final = 1e-4
"""Scores this much apart, in m, are the same to a reader."""
ABOUT: Final = {
    "morphology": "Each square holds the best robot of its body: how many modules, and {}.",
    "controller": "Each square holds the best robot of its way to move: the first two principal components of"
    " its head's paths.",
}
BODIES: Final = {
    "stiffness": "how stiff",
    "softest": "how stiff the softest one",
    "stiffest": "how stiff the stiffest one",
    "feet": "which feet",
}
"""What the second axis of a map of bodies says."""


def checked_link(link: str) -> str:
    """Return the address of a run, as it is to be clicked; an empty one for none.

    Raises:
        InvalidData: it is no address of a web page.
    """
    if not link:
        return ""
    try:
        parts = urllib.parse.urlsplit(link)
        whole = parts.scheme in ("http", "https") and bool(parts.hostname)
    except ValueError:
        whole = False
    if not whole or len(link) > MAX_LINK or not link.isprintable() or any(c.isspace() for c in link):
        raise InvalidData(
            f"link must be the address of a web page, such as https://doi.org/10.1000/182, not {link[:80]!r}"
        )
    return link


def atlas_page(
    reader: RunReader,
    *,
    shown: Shown | None = None,
    link: str = "",
    n_threads: int = 1,
    progress: Callable[[int, int], None] = lambda _n, _total: None,
) -> bytes:
    """Return the page of a run.

    Args:
        reader: of the run.
        shown: what the page shows, of ``what_to_show``, if that is known.
        link: where it can be had, see ``checked_link``.
        n_threads: threads that simulate.
        progress: told how many robots of how many have been simulated; what it raises ends the work.

    Raises:
        RunFileError: it has no finished generation, or is damaged.
        ExportError: there is nothing to show.
        InvalidData: the link is none, or today's robots do not survive the run's physics.
    """
    link, config, shown = checked_link(link), reader.config, shown or what_to_show(reader)
    task, robots = task_of(config), shown.robots
    done = 0.0

    def simulated(seconds: float) -> None:
        nonlocal done
        done += seconds
        progress(min(int(len(robots) * done / shown.seconds + 1e-6), len(robots)), len(robots))

    elements: dict[int, str] = {}
    off = differs = 0.0
    for evaluation, trials in replay_every_target(
        config,
        list(reader.evaluations(set(robots)).values()),
        updates_per_frame=updates_per_frame(config.physics.control_period),
        n_threads=n_threads,
        progress=simulated,
    ):
        number = evaluation.solution.number
        elite = pack_elite(
            config,
            evaluation,
            trials,
            cells=shown.cells[number],
            generation=robots[number].generation,
            again=None if shown.robust is None else shown.robust.fresh(number),
            line=reader.lineage(number),
        )
        off, differs = max(off, elite.off), max(differs, elite.differs)
        elements[number] = f'<script type="text/plain" id="r{number}">{elite.text}</script>'
    name = printable(reader.path.stem)
    data = {
        "run": name,
        "best": shown.best.number,
        "robots": {n: round(e.f_s, 2) for n, e in robots.items()},
        "maps": {
            p.view.name: {cell_name(c): e.number for c, e in p.elites.items()}
            for p in next(iter(shown.maps.values()))
        },
        "targets": list(task.target_names),
    }
    algorithm = ALGORITHM_NAMES.get(config.algorithm, config.algorithm)
    facts = [
        config.task,
        algorithm,
        f"{reader.n_evaluations():,} robots tried",
        f"{len(robots)} elites",
    ]
    fields = {
        "title": html.escape(name),
        "facts": html.escape(" · ".join(facts)),
        "link": _link(link),
        "view": own_file("replay_view.html"),
        "maps": _colorings(shown.maps) + _maps(shown),
        "about": _about(reader, shown, off, differs, link),
        "data": json_text(data),
        # a reader sees the best robot before the rest of the file has been read
        "first": elements.pop(shown.best.number),
        "robots": "\n".join(elements.values()),
    }
    return page(
        _data("page.html"),
        style=own_file("replay_view.css") + _data("page.css"),
        script=own_file("replay_view.js") + SCRIPT + _data("page.js"),
        fields=fields,
    )


def _maps(shown: Shown) -> str:
    """Return the maps as HTML: in the first colours, the others at hand."""
    return "".join(
        _map({name: maps[k] for name, maps in shown.maps.items()})
        for k in range(len(next(iter(shown.maps.values()))))
    )


def _map(by_coloring: Mapping[str, MapPicture]) -> str:
    first = next(iter(by_coloring.values()))
    family = axis_labels.family(first.axes)
    about = ABOUT[family].format(BODIES.get(first.axes[1].name, first.axes[1].name)) if family else ""
    explained = f'<p class="what">{html.escape(about)}</p>' if about else ""
    drawn = "".join(
        f'<template data-coloring="{html.escape(name)}">{_drawn(picture)}</template>'
        for name, picture in by_coloring.items()
    )
    return (
        f'<section class="map"><h2>{html.escape(first.title)}</h2>'
        f'<div class="drawn">{_drawn(first)}</div>'
        f"{explained}{drawn if len(by_coloring) > 1 else ''}</section>"
    )


def _drawn(picture: MapPicture) -> str:
    return f'<p class="figures">{html.escape(picture.figures)}</p>{picture.render(None, "")}'


def _colorings(names: Collection[str]) -> str:
    """Return where a reader chooses what maps are coloured by, as HTML; nothing if there is no choice."""
    if len(names) < 2:
        return ""
    options = "".join(f"<option>{html.escape(name)}</option>" for name in names)
    return f'<label id="colors">Coloured by <select id="coloring">{options}</select></label>'


def _link(link: str) -> str:
    if not link:
        return ""
    return (
        f'<a class="link" href="{html.escape(link)}" target="_blank" rel="noopener noreferrer">'
        "Get this run ↗</a>"
    )


def _about(reader: RunReader, shown: Shown, off: float, differs: float, link: str) -> str:
    """Return what the page holds and how true it is, as HTML."""
    task, update = task_of(reader.config), reader.config.physics.control_period
    period = updates_per_frame(update) * update
    lines = [
        words.markup(words.F_S)
        + f" It begins {100 * task.target_distance:.0f} cm away"
        + (
            "."
            if task.score is remaining_distance
            else f", and what counts is its {html.escape(task.score_name)}."
        ),
        *([] if shown.robust is None else [AGAIN]),
        words.PCA,
        f"The {len(shown.robots)} robots on this page evolved in simulation; none of them has been built."
        " Every one was simulated again for this page, towards every target, under the first noise that it"
        " evolved with"
        + (
            ", and ends where it was recorded to end."
            if differs <= SAME
            else f". The run was computed by other versions of the physics: what you see ends up to"
            f" {100 * differs:.1f} cm from where it was recorded to end, and the figures are the recorded"
            " ones."
        ),
        f"The file keeps a pose of every {period:.2g} s. In these no point of a robot is more than"
        f" {max(1000 * off, 0.01):.2f} mm from where it was simulated; between them points move along smooth"
        " curves, mostly within a millimetre.",
        "Nothing is loaded from anywhere: this file works offline, and can be kept with a paper.",
    ]
    made = f"Made with TensAtlas {html.escape(reader.versions.get('tensatlas', ''))}".rstrip()
    lines.append(
        f"{made} from the run <b>{html.escape(printable(reader.path.stem))}</b>,"
        f" begun {html.escape(reader.created_at[:10])}."
    )
    if link:
        lines.append(
            f'The whole run: <a href="{html.escape(link)}" target="_blank" rel="noopener noreferrer">'
            f"{html.escape(link)}</a>"
        )
    return "".join(f"<p>{line}</p>" for line in lines)


def _data(name: str) -> str:
    return (importlib.resources.files("viz.atlas") / name).read_text(encoding="utf-8")

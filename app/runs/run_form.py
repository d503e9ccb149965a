"""The form of a new run: every field of the configuration, with its docstring as a hint."""

from __future__ import annotations

import dataclasses
import functools
import html
import os
import re
import typing
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

import viser

from app.gui.field_docs import field_docs
from app.gui.widgets import ignoring_event, put
from app.runs.launcher import NewRun, check_name, choices
from app.worker_flags import MAX_WORKERS
from engine.config import PRESETS, RunConfig, from_json, inline_tables, preset
from engine.errors import InvalidData, TensAtlasError
from engine.runs.evolve import check_physics
from engine.simulation.physics import AS_BUILT
from viz import theme

EVERYDAY: Final = ("task", "algorithm", "evaluations", "seed")
"""Fields of the configuration that are seen at once; the others are under "More"."""
TITLES: Final = {
    "trials": "Trials",
    "physics": "Physics",
    "variation": "Variation",
    "body": "Bodies",
    "neat": "Controllers",
    "vie_neat": "ViE-NEAT",
}
"""Folders of the tables within the configuration."""


@dataclasses.dataclass(slots=True)
class _Field:
    """A field of the configuration on the page.

    Attributes:
        path: names that lead to it from the configuration.
        kind: its type.
        widget: that holds it.
        folder: that holds the widget.
    """

    path: tuple[str, ...]
    kind: Any
    widget: Any
    folder: Any

    @property
    def label(self) -> str:
        """What the page calls it."""
        return label_of(self.path[-1])


class RunForm:
    """Asks for a run and says by the field what is wrong with it.

    Args:
        gui: of one client.
        folder: to build it in.
        start: called to start the run that the form holds.
    """

    def __init__(self, gui: viser.GuiApi, folder: viser.GuiTabHandle, start: Callable[[], None]) -> None:
        self._gui = gui
        self._fields: list[_Field] = []
        self._mark: viser.GuiHtmlHandle | None = None
        self._as_built: dict[str, Any] = {}
        """Thirty numbers without fields here, kept by another run like one as built."""
        base = dataclasses.replace(PRESETS["quick"], seed=1)
        with folder:
            self._name = gui.add_text("Name", "my-run", hint="Becomes runs/NAME.tsmr")
            self._preset = gui.add_dropdown(
                "Preset",
                tuple(PRESETS),
                initial_value="quick",
                hint="smoke: seconds. quick: a short atlas. atlas: hours. paper: the published experiment",
            )
            for name in EVERYDAY:
                self._add(folder, base, (), name)
            n_cores = os.cpu_count() or 1
            self._workers = gui.add_slider(
                "Workers",
                min=1,
                max=max(n_cores, 2),
                step=1,
                initial_value=n_cores,
                hint="Threads that simulate; the result does not depend on it",
            )
            more = gui.add_folder("More", expand_by_default=False)
            with more:
                for owner, name in _own_fields(base):
                    if name not in EVERYDAY and name not in TITLES:
                        self._add(more, owner, (), name)
                self._add_tables(base, ())
            self._problem = gui.add_html("")
            self.start = gui.add_button(
                "Start",
                icon=viser.Icon.PLAYER_PLAY,
                hint="Evolve in a separate process, which outlives the browser and the app",
            )
        self.start.on_click(ignoring_event(start))
        self._preset.on_update(lambda event: self._fill(event) if event.client is not None else None)
        for widget in (self._name, self._workers, *(f.widget for f in self._fields)):
            widget.on_update(lambda event: self.check() if event.client is not None else None)

    def value(self) -> NewRun:
        """Return the run that the form holds.

        Raises:
            FieldError: a field holds an invalid value.
        """
        try:
            check_name(str(self._name.value))
        except InvalidData as e:
            raise FieldError(str(e), None) from None
        data: dict[str, Any] = {}
        for field in self._fields:
            part = data
            for name in field.path[:-1]:
                part = part.setdefault(name, {})
            try:
                part[field.path[-1]] = read(field.kind, field.widget.value)
            except ValueError as e:
                raise FieldError(f"{field.label}: {e}", field) from None
        data["physics"] |= self._as_built
        base = preset(str(self._preset.value))
        initial = base.map_search.initial
        if data["initial"] == initial:  # for few evaluations the preset's value is too large
            data["initial"] = min(initial, data["evaluations"])
        try:
            config = from_json(data)
            check_physics(config)
        except TensAtlasError as e:
            raise FieldError(str(e), self._meant(str(e))) from None
        return NewRun(
            name=str(self._name.value),
            preset=str(self._preset.value),
            config=config,
            workers=int(min(max(self._workers.value, 1), MAX_WORKERS)),
        )

    def check(self) -> None:
        """Say what is wrong with the form, if anything."""
        problem, field = "", None
        try:
            self.value()
        except FieldError as e:
            problem, field = str(e), e.field
        self.start.disabled = bool(problem)
        content = _problem(problem) if problem else ""
        if self._problem.content != content:
            self._problem.content = content
            self._put_mark(field, content)

    def _put_mark(self, field: _Field | None, content: str) -> None:
        """Put a line below a field."""
        if self._mark is not None:
            self._mark.remove()
            self._mark = None
        if field is not None and field.path[0] not in EVERYDAY:  # those are seen with the line below
            with field.folder:
                self._mark = self._gui.add_html(content, order=field.widget.order + 0.5)

    def _add_tables(self, owner: Any, path: tuple[str, ...]) -> None:
        """Add a folder for each table among the fields of a dataclass."""
        for group in (f.name for f in dataclasses.fields(owner) if f.name in TITLES):
            table, inside = getattr(owner, group), (*path, group)
            part = self._gui.add_folder(TITLES[group], expand_by_default=False)
            with part:
                for field in dataclasses.fields(table):
                    if field.name not in TITLES and field.name not in AS_BUILT:
                        self._add(part, table, inside, field.name)
                self._add_tables(table, inside)

    def _add(self, folder: Any, owner: Any, path: tuple[str, ...], name: str) -> None:
        owned: type = type(owner)
        kind, value = typing.get_type_hints(owned)[name], getattr(owner, name)
        label, hint = label_of(name), field_docs(owned).get(name)
        options = choices(name) if not path and name == "task" else typing.get_args(kind)
        widget: Any
        if kind is int:
            widget = self._gui.add_number(label, value, step=1, hint=hint)
        elif kind is bool:
            widget = self._gui.add_checkbox(label, value, hint=hint)
        elif kind is str or typing.get_origin(kind) is typing.Literal:
            widget = self._gui.add_dropdown(label, tuple(options), initial_value=value, hint=hint)
        else:  # viser would round a small number
            widget = self._gui.add_text(label, write(value), hint=hint)
        self._fields.append(_Field((*path, name), kind, widget, folder))

    def fill(self, config: RunConfig, name: str) -> None:
        """Take a configuration, with the next seed, for a run named after another one."""
        self._take(dataclasses.replace(config, seed=config.seed + 1))
        put(self._name, f"{re.sub(r'-seed-[0-9]+$', '', name)}-seed-{config.seed + 1}")
        self.check()

    def _fill(self, _event: viser.GuiEvent) -> None:
        """Take what the preset decides; what is to be evolved and how stays as it is."""
        self._take(preset(str(self._preset.value)), but=("task", "algorithm", "seed"))
        self.check()

    def _take(self, config: RunConfig, but: Sequence[str] = ()) -> None:
        self._as_built = {name: dataclasses.asdict(getattr(config.physics, name)) for name in AS_BUILT}
        # not as a file has them: it leaves out what files of older versions imply
        own = {name: getattr(owner, name) for owner, name in _own_fields(config)}
        for field in self._fields:
            if field.path[0] in but:
                continue
            value = functools.reduce(getattr, field.path[1:], own[field.path[0]])
            written = value if field.kind in (int, bool) else write(value)
            if written in getattr(field.widget, "options", (written,)):  # a task may be somebody's file
                put(field.widget, written)

    def _meant(self, message: str) -> _Field | None:
        """Return the field that a message is about: the first one that it names."""
        found = [
            (match.start(), -len(f.path[-1]), k)
            for k, f in enumerate(self._fields)
            if (match := re.search(rf"\b{f.path[-1].replace('_', '[_ ]')}\b", message))
        ]
        return self._fields[min(found)[2]] if found else None


def _own_fields(config: RunConfig) -> Iterator[tuple[Any, str]]:
    """Yield the fields that a run's configuration has in a file, each with what holds it."""
    inline = inline_tables(RunConfig)
    for field in dataclasses.fields(config):
        owner = getattr(config, field.name) if field.name in inline else config
        names = dataclasses.fields(owner) if field.name in inline else (field,)
        yield from ((owner, f.name) for f in names)


class FieldError(InvalidData):
    """A field of the form holds an invalid value.

    Args:
        message: for the user.
        field: that is wrong, None if it is not known which.
    """

    def __init__(self, message: str, field: _Field | None) -> None:
        super().__init__(message)
        self.field = field


def label_of(name: str) -> str:
    """Return what the page calls a field."""
    return name.replace("_", " ").capitalize()


def write(value: Any) -> Any:
    """Return a value of a field as its text widget or dropdown shows it."""
    if isinstance(value, tuple | list):
        return ", ".join(map(str, value))
    return value if isinstance(value, str) else f"{value:g}" if float(f"{value:g}") == value else repr(value)


def read(kind: Any, value: Any) -> Any:
    """Return what a widget says, as ``config.from_json`` expects it.

    Raises:
        ValueError: it is not of the field's kind; the message says what is wrong.
    """
    if typing.get_origin(kind) is tuple:
        return list(_whole_numbers(str(value)))
    if kind is float:
        try:
            return float(str(value).replace(",", "."))
        except ValueError:
            raise ValueError(f"expected a number, not {str(value)[:40]!r}") from None
    return value


def _whole_numbers(text: str) -> Iterator[int]:
    for part in filter(None, re.split(r"[,;\s]+", text)):
        if not re.fullmatch(r"\d{1,9}", part):
            raise ValueError(f"expected whole numbers such as 0, 2, 4, not {part[:40]!r}")
        yield int(part)


def _problem(text: str) -> str:
    return (
        f'<div class="ta-problem" role="alert" style="font-size:12px;line-height:1.45;color:{theme.BAD_TEXT};'
        f'padding:1px 10px 5px">{html.escape(text)}</div>'
    )

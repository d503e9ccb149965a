"""The form without a browser: widgets of a real server, whose values are set as a browser would."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Iterator
from typing import Any

import pytest
import viser

from app.gui.field_docs import field_docs
from app.runs.run_form import EVERYDAY, FieldError, RunForm
from engine.body.morphology import BodyRates
from engine.config import PRESETS, RunConfig, replaced
from engine.control.rates import NeatRates
from engine.fabrication.as_built import search_physics
from engine.fabrication.materials import load_materials
from engine.search.map_search import MapSearchConfig
from engine.search.variation import VariationConfig
from engine.search.vie_neat import VieNeatConfig
from engine.simulation.physics import Physics
from engine.simulation.trials import TrialConfig


@pytest.fixture
def form() -> Iterator[RunForm]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield RunForm(server.gui, server.gui.add_folder("New run"), lambda: None)
    server.stop()


def widget(form: RunForm, *path: str) -> Any:
    return next(f.widget for f in form._fields if f.path == path)


def test_every_field_of_the_configuration_is_asked_for_with_a_hint(form: RunForm) -> None:
    asked = {f.path for f in form._fields}
    for kind, prefix in (
        (RunConfig, ()),
        (MapSearchConfig, ()),
        (VieNeatConfig, ("vie_neat",)),
        (VariationConfig, ("variation",)),
        (BodyRates, ("variation", "body")),
        (NeatRates, ("variation", "neat")),
        (TrialConfig, ("trials",)),
        (Physics, ("physics",)),
    ):
        for field in dataclasses.fields(kind):
            nested = dataclasses.is_dataclass(typing.get_type_hints(kind)[field.name])
            assert nested or (*prefix, field.name) in asked
    for kind in (RunConfig, MapSearchConfig, TrialConfig, Physics, VieNeatConfig):
        assert set(field_docs(kind)) == {f.name for f in dataclasses.fields(kind)}
    assert all(f.widget.hint for f in form._fields)
    assert form.value().config == dataclasses.replace(PRESETS["quick"], seed=1)


@pytest.mark.parametrize("preset", list(PRESETS))
def test_a_preset_fills_the_form(form: RunForm, preset: str) -> None:
    form._preset.value = preset
    form._fill(None)  # type: ignore[arg-type]
    assert form.value().config == dataclasses.replace(PRESETS[preset], seed=1)
    widget(form, "evaluations").value = 5
    assert form.value().config.map_search.initial == 5


@pytest.mark.parametrize(
    ("path", "value", "said", "named"),
    [
        (("evaluations",), -1, "evaluations must be", ("evaluations",)),
        (("batch_size",), 0, "batch_size must be", ("batch_size",)),
        (("refit_generations",), "0, two", "Refit generations: expected", ("refit_generations",)),
        (("physics", "friction"), "rough", "Friction: expected a number", ("physics", "friction")),
        (("physics", "friction"), "-1", "friction must be positive", ("physics", "friction")),
        (("physics", "friction"), "nan", "friction: expected float", ("physics", "friction")),
        # of two fields that contradict each other the message names the other one first
        (("physics", "timestep"), "0.003", "control_period must be", ("physics", "control_period")),
        (("physics", "timestep"), "0.02", "timestep 0.02 s is too large", ("physics", "timestep")),
        (("trials", "repeats"), 0, "repeats must be", ("trials", "repeats")),
        (("trials", "trial_time"), "1e400", "trial_time: expected float", ("trials", "trial_time")),
        (("seed",), -5, "seed must be", ("seed",)),
        (("cell_capacity",), 0, "cell_capacity must be", ("cell_capacity",)),
    ],
)
def test_a_wrong_value_is_named_by_its_field_and_nothing_can_be_started(
    form: RunForm, path: tuple[str, ...], value: Any, said: str, named: tuple[str, ...]
) -> None:
    before = widget(form, *path).value
    widget(form, *path).value = value
    with pytest.raises(FieldError) as error:
        form.value()
    assert "\n" not in str(error.value)
    assert said in str(error.value)
    assert error.value.field is not None
    assert error.value.field.path == named
    form.check()
    assert form.start.disabled
    assert "ta-problem" in form._problem.content
    # what lies under "More" is marked where it is
    assert (form._mark is not None) == (named[0] not in EVERYDAY)
    widget(form, *path).value = before
    form.check()
    assert not form.start.disabled
    assert form._mark is None
    assert form._problem.content == ""


def test_a_name_that_is_none_for_a_file_is_said_so(form: RunForm) -> None:
    form._name.value = "a/b"
    with pytest.raises(FieldError, match="letters"):
        form.value()


def test_another_run_like_one_has_its_configuration_and_the_next_seed(form: RunForm) -> None:
    config = replaced(
        PRESETS["smoke"], task="squeezing", algorithm="map-elites", evaluations=77, seed=4, batch_size=8
    )
    form.fill(config, "mine")
    new = form.value()
    assert new.config == replaced(config, seed=5)
    assert new.name == "mine-seed-5"
    form.fill(new.config, new.name)
    assert form.value().name == "mine-seed-6"


def test_another_run_of_robots_as_built_is_one_of_robots_as_built(form: RunForm) -> None:
    materials = load_materials("latex-sheet")
    physics = search_physics(PRESETS["smoke"].physics, materials, spread=True)
    form.fill(dataclasses.replace(PRESETS["smoke"], physics=physics), "mine")
    assert form.value().config.physics == physics
    form._fill(None)
    assert form.value().config.physics == PRESETS["quick"].physics

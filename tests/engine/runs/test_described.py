"""A run described in a TOML file, read and written."""

import dataclasses
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.config import PRESETS, RunConfig, preset, replaced
from engine.errors import InvalidData
from engine.runs.described import describe, read_described
from engine.search.variation import VariationConfig
from tests.support.made_up import examples

changed = st.builds(
    lambda name, rate, seed, cells, **fields: replaced(
        preset(name),
        seed=seed,
        controller_cells=cells,
        variation=dataclasses.replace(
            preset(name).variation, neat=dataclasses.replace(preset(name).variation.neat, link_add=rate)
        ),
        physics=dataclasses.replace(preset(name).physics, **fields),
    ),
    st.sampled_from(list(PRESETS)),
    rate=st.floats(0.0, 1.0),
    seed=st.integers(0, 2**32 - 1),
    cells=st.tuples(st.integers(1, 50), st.integers(1, 50)),
    friction=st.floats(1e-9, 2.0),
    servo_noise=st.floats(0.0, 1e-3),
)


@pytest.fixture
def read(tmp_path):
    def of(text, chosen=None):
        path = tmp_path / "run.toml"
        path.write_text(text)
        return read_described(path, chosen)

    return of


@examples(60)
@given(changed)
def test_what_is_written_is_read_back_whatever_the_preset(read, config):
    text = describe(config)
    assert read(text) == read(text, "smoke") == config
    assert describe(read(text)) == text


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_survives(read, name):
    assert read(describe(preset(name))) == preset(name)


def test_what_is_left_out_comes_from_the_preset(read):
    assert read("") == RunConfig()
    assert read('preset = "smoke"') == preset("smoke")
    assert read('preset = "smoke"', "quick") == preset("quick")
    text = 'preset = "smoke"\nseed = 7\n[trials]\nrepeats = 1\n[variation.neat]\nweight_rate = 0.5\n'
    smoke = preset("smoke")
    neat = dataclasses.replace(smoke.variation.neat, weight_rate=0.5)
    expected = dataclasses.replace(
        smoke,
        seed=7,
        trials=dataclasses.replace(smoke.trials, repeats=1),
        variation=VariationConfig(neat=neat),
    )
    assert read(text) == expected


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("evaluation = 9", "configuration: unknown 'evaluation'; did you mean evaluations"),
        ("[variation]\nrate = 1", "configuration.variation: unknown 'rate'; known are body, neat"),
        ("[variation.neat]\nweight_rate = 1.5", "weight_rate must be from 0 to 1, not 1.5"),
        ("variation = 3", "configuration.variation: expected a table of body"),
        ('seed = "one"', "configuration.seed: expected int, not 'one'"),
        ("initial = 2.5", "configuration.initial: expected int, not 2.5"),
        ('preset = "huge"', "unknown preset 'huge'; choose from atlas"),
        ("preset = 3", "preset must be a name, not 3"),
        ("algorithm =", "not a TOML file"),
        ('task = "flying"', "unknown task 'flying'"),
    ],
)
def test_a_wrong_file_gets_one_line_that_names_it(read, text, reason):
    with pytest.raises(InvalidData, match=re.escape(reason)) as caught:
        read(text)
    assert "run.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidData, match=r"nowhere\.toml cannot be read"):
        read_described(tmp_path / "nowhere.toml")

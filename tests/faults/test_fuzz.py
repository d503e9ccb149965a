"""A few of the inputs of ``python -m benchmarks.fuzz``, and values that hypothesis thinks up."""

import json
import subprocess
import sys

from hypothesis import given, settings
from hypothesis import strategies as st

from engine.analysis.robustness import load_robust
from engine.body.morphology import Morphology
from engine.config import from_json
from engine.control.genome import Controller
from engine.errors import TensAtlasError, one_line
from engine.tasks.walls import Wall
from tests.support.faulty import ENVIRONMENT


def test_mutated_inputs_are_read_or_refused_and_nothing_else_happens():
    # a process of its own: its watch on what Python does stays for good
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.fuzz", "--inputs", "260"],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(" read, ") == 12


def test_the_watch_sees_what_it_should():
    code = """
import subprocess, sys, tempfile, os
from pathlib import Path
import benchmarks.fuzz as f
from benchmarks.fuzz import Kind, Outcome, feed
def misbehave(content, folder):
    exec("1 + 1")
    (folder.parent / "outside").write_text("x")
    subprocess.run(["true"])
    raise KeyError("crash")
outcome, folder = Outcome(), Path(tempfile.mkdtemp())
feed("bad", Kind(b"x", misbehave), 0, folder, outcome)
print("\\n".join(outcome.faults))
def wait(content, folder):
    while True: pass
f.PATIENCE = 1
outcome = Outcome()
feed("slow", Kind(b"x", wait), 0, folder, outcome)
print("\\n".join(outcome.faults))
"""
    done = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, capture_output=True, text=True)
    for what in (
        "ran code '<string>'",
        "outside for writing",
        "subprocess.Popen",
        "KeyError: 'crash'",
        "appeared outside its folder",
        "TimeoutError: it takes longer than 1 s",
    ):
        assert what in done.stdout, done.stdout + done.stderr


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda v: st.lists(v, max_size=5) | st.dictionaries(st.text(max_size=10), v, max_size=5),
    max_leaves=10,
)
KEYS = {
    Morphology.from_json: ("stiffness_level", "faces"),
    Controller.from_json: ("n_inputs", "nodes", "connections"),
    Wall.from_json: ("centre", "half_size", "yaw"),
    from_json: ("task", "algorithm", "evaluations", "refit_generations", "trials", "physics", "vie_neat"),
}


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(list(KEYS)), st.data())
def test_any_json_is_read_or_refused(read, data):
    keys = KEYS[read]
    shaped = st.fixed_dictionaries(dict.fromkeys(keys, json_values))
    try:
        read(data.draw(json_values | shaped))
    except TensAtlasError as e:
        assert str(e).isprintable()  # noqa: PT017


@settings(max_examples=50, deadline=None)
@given(json_values)
def test_any_results_of_evaluating_again_are_read_or_refused(tmp_path_factory, value):
    path = tmp_path_factory.mktemp("robust") / "x.robust.json"
    for content in (value, {"format": 1, "created_at": "", "versions": {}, "elites": value}):
        path.write_text(json.dumps(content))
        try:
            load_robust(path)
        except TensAtlasError as e:
            assert str(e).isprintable()  # noqa: PT017


@settings(max_examples=50, deadline=None)
@given(st.text(max_size=3000))
def test_a_message_is_one_line_of_sensible_length(text):
    line = one_line(text)
    assert line.isprintable()
    assert len(line) <= 1000

"""Which rod ends get feet, and which way these point."""

import dataclasses
import io
import random
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from engine.body.feet import BodyConfig
from engine.body.morphology import Morphology
from engine.config import task_of
from engine.control.operators import Neat
from engine.fabrication.dimensions.feet import LEAST_SHARE, NO_FEET, planned_feet, robot_feet
from engine.fabrication.dimensions.joints import joints
from engine.fabrication.materials import load_materials
from engine.fabrication.parts.assembly import robot_glb
from engine.replay.contact_record import ContactRecord
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.tasks import get_task

BODY = Morphology(5, (1, 2), feet="end")


def record_of(shares, facing=(1.0, 0.0, 0.0), resting=()):
    """Return a record in which rod ends (module, node) touch for so much of the time, all facing alike."""
    share, rests = np.zeros((2, 12)), np.zeros((2, 12), bool)
    for end, part in shares.items():
        share[end] = part
    for end in resting:
        rests[end] = True
    every = np.broadcast_to(np.asarray(facing, float), (2, 12, 3))
    return ContactRecord(rests, share, 0.1 * share, 0.01 * share, share, every * (share > 0)[..., None])


def test_rod_ends_that_touch_long_enough_or_at_rest_get_feet():
    tied = {(j.module + k, pair[k]) for j in joints(BODY) for pair in j.node_pairs for k in (0, 1)}
    a, b, c = [end for end in np.ndindex(2, 12) if end not in tied][:3]
    plan = planned_feet(BODY, record_of({a: 0.5, b: LEAST_SHARE / 2, c: LEAST_SHARE / 2}, resting=[c]))
    assert [(f.module, f.node) for f in plan.feet] == sorted([a, c])
    assert [f.number for f in plan.feet] == [1, 2]
    assert plan.covered == pytest.approx((0.5 + LEAST_SHARE / 2) / (0.5 + LEAST_SHARE))
    assert plan.feet[0].forward == pytest.approx(0.05)


def test_of_two_tied_rod_ends_the_one_that_touches_more_gets_a_foot():
    joint = joints(BODY)[0]
    first, second = joint.node_pairs[0]
    for shares, wearer in (((0.2, 0.6), (1, second)), ((0.6, 0.2), (0, first))):
        plan = planned_feet(BODY, record_of({(0, first): shares[0], (1, second): shares[1]}))
        assert [(f.module, f.node) for f in plan.feet] == [wearer]
        assert plan.covered == pytest.approx(0.75)


@pytest.mark.parametrize("lean", [5, 40, 90, 140, 178])
@pytest.mark.parametrize("turn", [0, 77, -120])
def test_a_foot_points_nearly_where_its_rod_end_slides(lean, turn):
    a, b = np.radians(lean), np.radians(turn)
    facing = np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])
    end = next(e for e in np.ndindex(2, 12) if e[0] == 0)
    (foot,) = planned_feet(BODY, record_of({end: 0.5}, 0.9 * facing, [end])).feet
    between = np.degrees(np.arccos(facing @ foot.direction))
    assert between <= 16.0
    # a mean that is shorter than 1 comes from a rod end that turns
    assert foot.off == pytest.approx(np.degrees(np.arccos(0.9 * np.cos(np.radians(between)))))
    # seen from outside, along -z, angles that grow against the clock are those of x and y
    if foot.lean not in (0, 180):
        assert (foot.clock + turn + 5) % 360 <= 10


def test_a_rod_end_that_never_touches_gets_none():
    assert planned_feet(BODY, record_of({})).feet == ()
    assert planned_feet(BODY, record_of({})).covered == 0.0


@pytest.mark.parametrize("toward", ["end", "start"])
def test_built_feet_point_along_the_chain(small_config, toward):
    """From the simulated trials to the places of the parts in the assembled robot."""
    config = dataclasses.replace(small_config, body=BodyConfig(feet="directional", feet_toward=toward))
    body = Morphology(4, (3, 6, 1), feet=toward)
    controller = Neat(n_inputs=get_task(config.task).n_inputs).random(random.Random(3))
    solution = Solution(number=1, morphology=body, controller=controller)
    evaluator = LocalEvaluator(
        task=task_of(config), physics=config.physics, trials=config.trials, run_seed=config.seed
    )
    ((evaluation,),) = evaluator.evaluate([solution])
    plan = robot_feet(config, evaluation)
    assert len(plan.feet) >= 4
    assert plan.covered > 0.8
    scene = trimesh.load(io.BytesIO(robot_glb(body, load_materials(), plan.feet)), file_type="glb")
    names = scene.graph.nodes_geometry
    centres = [
        np.mean([scene.graph[n][0][:3, 3] for n in names if n.startswith(f"module{m}_cap")], axis=0)
        for m in (1, 2, 3)
    ]
    way = (centres[2] - centres[0]) * (1.0 if toward == "end" else -1.0)
    for foot in plan.feet:
        lean = np.radians(foot.lean)
        turned = scene.graph[f"module{foot.module + 1}_foot_{foot.node}"][0][:3, :3]
        slides = turned @ [np.sin(lean), 0.0, np.cos(lean)]
        # a module on the ground is not quite that which floats
        assert slides @ way / np.linalg.norm(way) > np.cos(np.radians(45))


def test_a_robot_without_feet_is_not_simulated_for_them(small_config):
    solution = Solution(number=1, morphology=Morphology(4, (3, 6, 1)), controller=None)
    assert robot_feet(small_config, SimpleNamespace(solution=solution)) is NO_FEET

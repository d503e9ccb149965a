"""What the host tells equals what the simulation senses, for every built-in task."""

import dataclasses

import numpy as np
import pytest

from app.drive.eyes import HeadPose
from app.drive.sensing import Sensing
from engine.body.morphology import Morphology
from engine.config import preset, task_of
from engine.errors import InvalidData
from engine.replay.replay import repeat_trial
from engine.tasks import Task, sensed
from tests.support.made_up import evaluation, evolved_controller


@pytest.mark.parametrize(("task", "n_inputs"), [("goal-reaching", 2), ("squeezing", 5)])
@pytest.mark.parametrize("target", [0, 1])
def test_a_host_senses_what_the_simulation_does(task, n_inputs, target):
    usual = preset("smoke")
    times = dataclasses.replace(usual.trials, settle_time=0.4, trial_time=3.0)
    config = dataclasses.replace(usual, task=task, trials=times)
    made = evaluation(7, morphology=Morphology(2, (1, 2, 3)))
    controller = evolved_controller(4, 20, n_inputs=n_inputs)
    made = dataclasses.replace(made, solution=dataclasses.replace(made.solution, controller=controller))
    loop = repeat_trial(config, made, target=target, repeat=0)

    def pose(view):
        x, y = view.position[0, 0]
        ahead = view.direction[0, 0]
        return HeadPose(x, y, np.arctan2(ahead[1], ahead[0]))

    start = loop.view()
    sensing = Sensing(task_of(config), 3, pose(start), start.target[0, 0])
    seen = []
    for k in range(30):
        view = loop.view()
        expected = sensed(task_of(config), view, loop.sim.alive)[0, 0] / task_of(config).units
        found = sensing.values(pose(view), view.target[0, 0], 0.1 * k)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
        seen.append(found)
        loop.advance(5)
    assert np.ptp(seen, axis=0)[0] > 1e-3


def test_what_no_camera_sees_gets_one_line():
    task = Task(
        name="mine",
        inputs=("height",),
        sense=lambda view: view.height[..., None],
        target_distance=0.3,
        target_bearings=(0.0,),
    )
    head = HeadPose(0.0, 0.0, 0.0)
    sensing = Sensing(task, 3, head, np.array([0.3, 0.0]))
    with pytest.raises(InvalidData, match="task mine senses heights or modules, which a camera does not see"):
        sensing.values(head, np.array([0.3, 0.0]), 0.0)

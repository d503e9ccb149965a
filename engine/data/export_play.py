"""Plays controls.csv on robot.xml and compares where the head goes with trajectory.csv.

Needs mujoco and numpy. With --view the motion is shown in MuJoCo's viewer, in real time.
"""

import argparse
import contextlib
import json
import time
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Run the recorded trial."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--view", action="store_true", help="show the motion in MuJoCo's viewer")
    view = parser.parse_args().view

    model = mujoco.MjModel.from_xml_string((HERE / "robot.xml").read_text(encoding="utf-8"))
    about = json.loads((HERE / "genotype.json").read_text(encoding="utf-8"))
    controls = np.loadtxt(HERE / "controls.csv", delimiter=",", skiprows=1, ndmin=2)
    recorded = np.loadtxt(HERE / "trajectory.csv", delimiter=",", skiprows=1, ndmin=2)
    head, period = about["head"], about["config"]["physics"]["control_period"]
    steps = round(period / model.opt.timestep)
    per_second = round(1.0 / period)

    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("settled").id)
    data.qacc_warmstart[:] = model.numeric("settled_qacc_warmstart").data

    def face(bodies: list[str]) -> np.ndarray:
        # each rod has a free joint, whose first two coordinates are its horizontal position
        at = [model.jnt_qposadr[model.body(name).jntadr[0]] for name in bodies]
        return np.mean([data.qpos[i : i + 2] for i in at], axis=0)

    origin = face(head["front_bodies"])
    ahead = origin - face(head["rear_bodies"])
    ahead /= np.linalg.norm(ahead)
    axes = np.array([ahead, [-ahead[1], ahead[0]]])

    def position() -> np.ndarray:
        return axes @ (face(head["front_bodies"]) - origin)

    path = [position()]
    with contextlib.ExitStack() as stack:
        viewer = None
        if view:
            from mujoco.viewer import launch_passive

            viewer = stack.enter_context(launch_passive(model, data))
        start = time.monotonic()
        for k, lengths in enumerate(controls[:, 1:], start=1):
            data.ctrl[:] = lengths
            mujoco.mj_step(model, data, steps)
            if k % per_second == 0:
                path.append(position())
            if viewer is not None:
                if not viewer.is_running():
                    return
                viewer.sync()
                time.sleep(max(0.0, start + k * period - time.monotonic()))

    end, target = position(), recorded[-1, 3:5]
    gap = 1000.0 * np.linalg.norm(np.array(path) - recorded[:, 1:3], axis=1)
    print(f"The head ends at x = {end[0]:.4f} m, y = {end[1]:.4f} m.")
    print(f"Distance from the target: {100.0 * np.linalg.norm(target - end):.2f} cm.")
    print(f"Distance from trajectory.csv: at most {gap.max():.6f} mm, {gap[-1]:.6f} mm at the end.")


if __name__ == "__main__":
    main()

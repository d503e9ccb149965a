"""What a simulation records to be looked at: frames, what lies between two of them, and contacts.

``Playable`` is what the player asks of a recording, whatever makes it: a replay, a what-if, a dump.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final, Protocol

import mujoco
import numpy as np

from engine.body.morphology import Morphology
from engine.simulation.rollout import Head
from engine.tasks.walls import Wall

UPDATES_PER_FRAME: Final = 2
"""Control updates between two recorded frames: 25 frames a second at 50 Hz."""
NEAR: Final = 1e-4
"""Part of a period within which a moment is that of a recorded frame."""


@dataclasses.dataclass(frozen=True, slots=True)
class ReplayFrame:
    """A robot at one moment.

    Attributes:
        time: seconds since the trial's clock started; negative while the robot settles.
        pose: (modules, 6, 7) float32 positions (m) and quaternions (w, x, y, z) of the rods.
        lengths: (modules, 5) float32 commanded lengths of the internal cables, in m.
        head: (2,) float32 horizontal position of the head, in m.
        contacts: (n, 3) float32 points where it touches the ground or a wall, in m.
        sensed: (inputs,) what its controller sensed at the update before, None while it has no say.
    """

    time: float
    pose: np.ndarray
    lengths: np.ndarray
    head: np.ndarray
    contacts: np.ndarray
    sensed: np.ndarray | None = None

    @classmethod
    def of(
        cls,
        time: float,
        qpos: np.ndarray,
        lengths: np.ndarray,
        head: Head,
        *,
        contacts: np.ndarray,
        sensed: np.ndarray | None = None,
    ) -> ReplayFrame:
        """Take a frame.

        Args:
            time: of the trial's clock, in s.
            qpos: (modules x 42,) generalised coordinates.
            lengths: (modules, 5) commanded lengths of the internal cables, in m.
            head: which end of the robot is its head.
            contacts: (n, 3) points where it touches the world, in m.
            sensed: (inputs,) what its controller sensed last, None while it has no say.
        """
        pose = qpos.reshape(len(lengths), -1, 7).astype(np.float32)
        return cls(
            time=time,
            pose=pose,
            lengths=lengths.astype(np.float32),
            head=pose[head.module, list(head.front), :2].mean(axis=0),
            contacts=contacts,
            sensed=None if sensed is None else sensed.copy(),
        )


class Playable(Protocol):
    """A simulation whose frames can be shown while it runs."""

    @property
    def frames(self) -> Sequence[ReplayFrame]:
        """What has been simulated, every ``frame_period``; only ever grows."""
        ...

    @property
    def target(self) -> np.ndarray | None:
        """(2,) the target in the world, in m, or None."""
        ...

    @property
    def walls(self) -> tuple[Wall, ...]:
        """What stands in the world; the walls go up when the target is placed."""
        ...

    @property
    def failure(self) -> str | None:
        """Why the simulation failed, once it has."""
        ...

    @property
    def head(self) -> Head:
        """Which end of the robot is its head."""
        ...

    @property
    def morphology(self) -> Morphology:
        """The robot's body."""
        ...

    @property
    def start_time(self) -> float:
        """Time of the clock one ``frame_period`` before the first frame, in s."""
        ...

    @property
    def end_time(self) -> float:
        """Time of the clock that ``advance`` is first asked to simulate to, in s."""
        ...

    @property
    def frame_period(self) -> float:
        """Seconds between two frames."""
        ...

    def cancel(self) -> None:
        """Make ``advance`` return soon, and at once from then on."""
        ...

    def advance(self, until: float) -> None:
        """Simulate until a time of the clock, in s, a failure or ``cancel``."""
        ...


def frame_at(replay: Playable, moment: float) -> ReplayFrame:
    """Return the frame of a moment; never one beyond what has been simulated.

    Args:
        replay: of which there is a frame.
        moment: of its clock, in s.

    Returns:
        The recorded frame itself where there is one, and before the first and after the last.
    """
    frames = replay.frames
    first, part = place_of(replay, moment)
    return between(frames[first], frames[first + 1], part) if part else frames[first]


def place_of(replay: Playable, moment: float) -> tuple[int, float]:
    """Return which recorded frame a moment follows, and what part of the way to the next one it is.

    Args:
        replay: of which there is a frame.
        moment: of its clock, in s.

    Returns:
        The index of the frame and a part from 0 to below 1; 0 where there is no next frame, and 0 for the
        first frame before it.
    """
    last = len(replay.frames) - 1
    place = (moment - replay.start_time) / replay.frame_period - 1.0
    nearest = min(max(round(place), 0), last)
    if not 0.0 < place < last or abs(place - nearest) < NEAR:
        return nearest, 0.0
    first = math.floor(place)
    return first, place - first


def nearest_index(replay: Playable, moment: float) -> int:
    """Return the index of the recorded frame that is nearest to a moment; arguments as of ``place_of``."""
    return round(sum(place_of(replay, moment)))


def between(one: ReplayFrame, other: ReplayFrame, part: float) -> ReplayFrame:
    """Return what lies a part of the way, from 0 to 1, from a frame to one soon after it.

    Positions, lengths and the head move along straight lines, rods turn as ``mix_turns`` has it. Contacts
    and what is sensed are the nearer frame's.
    """
    nearer = one if part < 0.5 else other
    pose = mix(one.pose, other.pose, part)
    pose[..., 3:] = mix_turns(one.pose[..., 3:], other.pose[..., 3:], part)
    return ReplayFrame(
        time=one.time + part * (other.time - one.time),
        pose=pose,
        lengths=mix(one.lengths, other.lengths, part),
        head=mix(one.head, other.head, part),
        contacts=nearer.contacts,
        sensed=nearer.sensed,
    )


def mix_turns(one: np.ndarray, other: np.ndarray, part: float) -> np.ndarray:
    """Return what lies a part of the way, from 0 to 1, from quaternions (..., 4) to others, as float32.

    They move along straight lines, the shorter way, and are scaled to unit length: within a frame's time a
    rod turns little, so that this is close to the great circle.
    """
    # q and -q are the same turn
    sign = np.where((one * other).sum(axis=-1, keepdims=True) < 0.0, np.float32(-1.0), np.float32(1.0))
    turn = mix(one, sign * other, part)
    return turn / np.sqrt((turn * turn).sum(axis=-1, keepdims=True))


def mix(one: np.ndarray, other: np.ndarray, part: float) -> np.ndarray:
    """Return what lies a part of the way, from 0 to 1, from an array to another, as float32."""
    return ((1.0 - part) * one + part * other).astype(np.float32, copy=False)


class ContactFinder:
    """Finds contacts of a robot in a pose, apart from any simulation, which therefore never notices.

    It takes 0.03 ms for ten modules. MuJoCo's collision detection does the work, so these are the contacts
    that a simulation has in that pose.

    Args:
        model: of the robot and its world; it is not changed.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self._data = mujoco.MjData(model)
        self._of_world = model.body_weldid[model.geom_bodyid] == 0

    def find(self, qpos: np.ndarray) -> np.ndarray:
        """Return the (n, 3) float32 points, in m, where rods touch what does not move.

        Args:
            qpos: (nq,) generalised coordinates.
        """
        data = self._data
        data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        mujoco.mj_collision(self.model, data)
        with_world = self._of_world[data.contact.geom].any(axis=1)
        return data.contact.pos[with_world].astype(np.float32)

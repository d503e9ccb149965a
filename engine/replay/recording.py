"""What a simulation records for viewing: frames, interpolation between two of them, and contacts.

``Playable`` is the player's interface to any recording: a replay, a what-if, a dump.
"""

from __future__ import annotations

import dataclasses
import math
import threading
from collections.abc import Callable, Sequence
from typing import Final, Protocol

import mujoco
import numpy as np

from engine.body.morphology import Morphology
from engine.simulation.rollout import Head
from engine.tasks.walls import Wall

UPDATES_PER_FRAME: Final = 2
"""Control updates between two recorded frames: 25 frames a second at 50 Hz."""
NEAR: Final = 1e-4
"""A moment closer to a recorded frame than this part of the frame period shows that frame."""


@dataclasses.dataclass(frozen=True, slots=True)
class ReplayFrame:
    """A robot at one moment.

    Attributes:
        time: seconds since the trial's clock started; negative while the robot settles.
        pose: (modules, 6, 7) float32 positions (m) and quaternions (w, x, y, z) of the rods.
        lengths: (modules, 5) float32 commanded lengths of the internal cables, in m.
        head: (2,) float32 horizontal position of the head, in m.
        find_contacts: returns the contacts; it may take a moment at the first call.
        sensed: (inputs,) what its controller sensed at the last update, None before the trial begins.
        forces: (modules, 12, 3) float16 of the ground on its nodes, in N; None where nobody knows them.
    """

    time: float
    pose: np.ndarray
    lengths: np.ndarray
    head: np.ndarray
    find_contacts: Callable[[], np.ndarray]
    sensed: np.ndarray | None = None
    forces: np.ndarray | None = None

    @property
    def contacts(self) -> np.ndarray:
        """(n, 3) float32 points where it touches the ground or a wall, in m."""
        return self.find_contacts()


class Playable(Protocol):
    """A simulation whose frames can be shown while it runs."""

    @property
    def frames(self) -> Sequence[ReplayFrame]:
        """The frames simulated so far, one every ``frame_period``; the list only grows."""
        ...

    @property
    def target(self) -> np.ndarray | None:
        """(2,) the target in the world, in m, or None."""
        ...

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The walls in the world; they go up when the target is placed."""
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
        The recorded frame if the moment has one, the first or the last frame beyond the ends, else a mixture
        of its two neighbours.
    """
    frames = replay.frames
    first, part = place_of(replay, moment)
    return between(frames[first], frames[first + 1], part) if part else frames[first]


def place_of(replay: Playable, moment: float) -> tuple[int, float]:
    """Return which recorded frame a moment follows, and how far it lies towards the next one.

    Args:
        replay: of which there is a frame.
        moment: of its clock, in s.

    Returns:
        The index of the frame, and the part of the way to the next one, from 0 to below 1. The part is 0
        where there is no next frame, and both are 0 before the first frame.
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
    """Interpolate between a frame, at ``part`` 0, and one soon after it, at 1.

    Positions, lengths and the head move along straight lines, rods turn as ``mix_turns`` has it. Contacts,
    forces and what is sensed are the nearer frame's.
    """
    nearer = one if part < 0.5 else other
    pose = mix(one.pose, other.pose, part)
    pose[..., 3:] = mix_turns(one.pose[..., 3:], other.pose[..., 3:], part)
    return ReplayFrame(
        time=one.time + part * (other.time - one.time),
        pose=pose,
        lengths=mix(one.lengths, other.lengths, part),
        head=mix(one.head, other.head, part),
        find_contacts=nearer.find_contacts,
        sensed=nearer.sensed,
        forces=nearer.forces,
    )


def mix_turns(one: np.ndarray, other: np.ndarray, part: float) -> np.ndarray:
    """Interpolate between quaternions (..., 4), the first at ``part`` 0, the others at 1, as float32.

    The interpolation is linear, the shorter way, and scaled to unit length: within a frame's time a rod turns
    little, so that this is close to the great circle.
    """
    # q and -q are the same turn
    sign = np.where((one * other).sum(axis=-1, keepdims=True) < 0.0, np.float32(-1.0), np.float32(1.0))
    turn = mix(one, sign * other, part)
    return turn / np.sqrt((turn * turn).sum(axis=-1, keepdims=True))


def mix(one: np.ndarray, other: np.ndarray, part: float) -> np.ndarray:
    """Interpolate between two arrays, the first at ``part`` 0, the second at 1, as float32."""
    return ((1.0 - part) * one + part * other).astype(np.float32, copy=False)


class ContactFinder:
    """Finds the contacts of a robot in a pose, without touching its simulation. Threads may share it.

    It takes 0.03 ms for ten modules. MuJoCo's collision detection does the work, so these are the contacts
    that a simulation has in that pose.

    Args:
        model: of the robot and its world; it is not changed.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self._data = mujoco.MjData(model)
        self._mutex = threading.Lock()
        self._of_world = model.body_weldid[model.geom_bodyid] == 0

    def find(self, qpos: np.ndarray) -> np.ndarray:
        """Return the (n, 3) float32 points, in m, where rods touch what does not move.

        Args:
            qpos: (nq,) generalised coordinates.
        """
        data = self._data
        with self._mutex:
            data.qpos[:] = qpos
            mujoco.mj_kinematics(self.model, data)
            mujoco.mj_comPos(self.model, data)
            mujoco.mj_collision(self.model, data)
            with_world = self._of_world[data.contact.geom].any(axis=1)
            return data.contact.pos[with_world].astype(np.float32)

    def later(self, qpos: np.ndarray) -> Callable[[], np.ndarray]:
        """Return a function that finds the contacts at its first call, and then remembers them."""
        return _FoundLater(self, qpos)


class _FoundLater:
    """Contacts of one pose; a replay has a thousand of them, most of which nobody looks at."""

    __slots__ = ("_finder", "_found", "_qpos")

    def __init__(self, finder: ContactFinder, qpos: np.ndarray) -> None:
        self._finder, self._qpos = finder, qpos
        self._found: np.ndarray | None = None

    def __call__(self) -> np.ndarray:
        if self._found is None:
            self._found = self._finder.find(self._qpos)
        return self._found

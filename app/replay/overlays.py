"""What is drawn besides a robot's body: the numbers of its modules, where it touches, its head's trail.

Each is one batch, so one message however large the robot is, and sent only when it has changed.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from app.gui.viser_private import put_arrays
from app.replay.shapes import Discs, disc_glb
from engine.body import module as t
from engine.replay.recording import Playable
from viz import theme
from viz.robot.geometry import friction_arrows
from viz.robot.stroke_font import NumberStrokes

TRAIL_STEP = 5
"""Frames between two points of the trail."""
TRAIL_HEIGHT = 0.002
CONTACT_RADIUS = 0.009
FRICTION_THICKNESS = 0.0022
NO_ARROWS = np.zeros((0, 3, 2, 3), dtype=np.float32)
CONTACT_LIFT = 0.0025
"""Metres that the rings lie above the points of contact, out of the ground."""
NUMBER_SIZE = 0.0115
NUMBER_LIFT = 0.07
"""Metres from a module's centre up to the middle of its number: just above the module."""
NUMBER_AHEAD = 0.002
"""Metres that a number stands before its chip."""
CHIP_RADIUS = 0.012
NUMBER_STEP = 0.001
"""Metres that a module moves before its number moves with it."""
TURN_STEP = 0.01
"""Radians, roughly, that the camera turns before the numbers turn with it."""


@dataclasses.dataclass(frozen=True, slots=True)
class Overlays:
    """Which overlays are shown."""

    tension: bool = True
    numbers: bool = True
    contacts: bool = True
    trail: bool = True


_RING = ((*theme.CONTACT, 0), (*theme.CONTACT, 235), (*theme.CONTACT, 235), (*theme.CONTACT, 0))
_RING_RADII = (0.5, 0.62, 0.88, 1.0)
_CHIP = ((*theme.CHIP, 255), (*theme.CHIP, 255))


class OverlayLayer:
    """Draws the overlays of one replay.

    Args:
        scene: of one client.
        replay: the robot.
        prefix: name of the node that everything hangs below.
        trail: colour of the trail of its head.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        replay: Playable,
        *,
        prefix: str = "",
        trail: tuple[int, int, int] = theme.TRAIL,
    ) -> None:
        self._replay = replay
        n = replay.morphology.n_modules
        self._strokes = NumberStrokes([t.module_number(i) for i in range(n)], height=NUMBER_SIZE)
        colors = np.tile(np.array(theme.NUMBER, dtype=np.uint8), (len(self._strokes.owner), 2, 1))
        colors[self._strokes.owner == replay.head.module] = theme.HEAD_ROD
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        self._numbers = scene.add_line_segments(
            f"{prefix}/robot/numbers",
            np.zeros((len(colors), 2, 3), dtype=np.float32),
            theme.linear(colors),
            thickness=0.0014,
            visible=False,
        )
        self._trail = scene.add_line_segments(f"{prefix}/trail", nothing, trail, thickness=0.003)
        self._chips = Discs(scene, f"{prefix}/robot/chips", disc_glb(_CHIP), CHIP_RADIUS)
        self._contacts = Discs(
            scene, f"{prefix}/robot/contacts", disc_glb(_RING, _RING_RADII), CONTACT_RADIUS
        )
        self._friction = scene.add_line_segments(
            f"{prefix}/friction", nothing, theme.CONTACT, thickness=FRICTION_THICKNESS, visible=False
        )
        self._trail_end = -1
        self._touching: np.ndarray | None = None
        self._centres: np.ndarray | None = None
        self._facing: np.ndarray | None = None

    def remove(self) -> None:
        """Take all overlays away."""
        for handle in (self._numbers, self._trail, self._chips, self._contacts, self._friction):
            handle.remove()

    def show(self, index: int, centres: np.ndarray, overlays: Overlays, facing: np.ndarray) -> None:
        """Draw the overlays of a frame.

        Args:
            index: of the recorded frame that is nearest.
            centres: (modules, 3) of the modules, in m.
            overlays: which ones.
            facing: (2, 3) directions in the world that are right and up on the screen.
        """
        trail, contacts = self._path(index), self._replay.frames[index].contacts
        _see(self._trail, visible=overlays.trail)
        if overlays.trail and trail is not None:
            self._trail.points = trail
        if not (overlays.contacts and len(contacts)):
            self._contacts.see(False)
        elif contacts is not self._touching:
            self._touching = contacts
            self._contacts.show(contacts + np.array([0.0, 0.0, CONTACT_LIFT]))
        else:
            self._contacts.see(True)
        self._show_friction(index, overlays)
        self._show_numbers(centres, overlays, facing)

    def face(self, overlays: Overlays, facing: np.ndarray) -> None:
        """Turn the numbers to a camera that has turned."""
        if self._centres is not None:
            self._show_numbers(self._centres, overlays, facing)

    def _show_numbers(self, centres: np.ndarray, overlays: Overlays, facing: np.ndarray) -> None:
        if overlays.numbers and not (
            self._centres is not None
            and self._facing is not None
            and np.abs(centres - self._centres).max() < NUMBER_STEP
            and np.abs(facing - self._facing).max() < TURN_STEP
        ):
            self._centres, self._facing = centres, facing
            right, up = facing
            near = np.cross(right, up)
            middles = centres + np.array([0.0, 0.0, NUMBER_LIFT])
            feet = middles - NUMBER_SIZE / 2 * up + NUMBER_AHEAD * near
            put_arrays(self._numbers, points=self._strokes.place(feet, right, up))
            turn = Rotation.from_matrix(np.column_stack([right, up, near])).as_quat(scalar_first=True)
            self._chips.show(middles, turn)
        self._chips.see(overlays.numbers)
        _see(self._numbers, visible=overlays.numbers)

    def _show_friction(self, index: int, overlays: Overlays) -> None:
        frame = self._replay.frames[index]
        arrows = NO_ARROWS
        if overlays.contacts and frame.forces is not None:
            arrows = friction_arrows(frame.pose, frame.forces)
        if len(arrows):
            self._friction.points = arrows.reshape(-1, 2, 3)
        _see(self._friction, visible=len(arrows) > 0)

    def _path(self, index: int) -> np.ndarray | None:
        """Return the (n, 2, 3) trail up to a frame, or None if it need not be sent again."""
        end = index // TRAIL_STEP
        if end == self._trail_end:
            return None
        self._trail_end = end
        replay = self._replay
        first = round(-replay.start_time / replay.frame_period)
        heads = [f.head for f in replay.frames[max(first - 1, 0) : index + 1 : TRAIL_STEP]]
        if len(heads) < 2:
            return np.zeros((1, 2, 3), dtype=np.float32)
        points = np.column_stack([np.array(heads), np.full(len(heads), TRAIL_HEIGHT)])
        return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def _see(handle: viser.SceneNodeHandle, *, visible: bool) -> None:
    if handle.visible != visible:
        handle.visible = visible

"""The whole robot as one GLB scene in metres, every part in its place, and how much room the servo has."""

from __future__ import annotations

import functools
from typing import Any, Final

import mujoco
import numpy as np
import trimesh
from manifold3d import Manifold
from trimesh.visual.material import PBRMaterial

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.dimensions.floating_module import CONTRACTED, HOLD, floating_module
from engine.fabrication.materials import CAP_TIP, Materials
from engine.fabrication.parts import drum, shapes, solids
from engine.fabrication.parts import servo_parts as sp
from engine.fabrication.parts.foot import foot
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics

_COLOURS: Final = {
    "rod": (45, 45, 50, 255),
    "cap": (230, 120, 40, 255),
    "cable": (90, 165, 220, 255),
    "servo": (40, 80, 160, 255),
    "mount": (230, 120, 40, 255),
    "drum": (240, 200, 60, 255),
    "ballast": (60, 140, 150, 255),
    "line": (200, 60, 60, 255),
    "link": (110, 190, 110, 255),
    "foot": (235, 90, 160, 255),
}
_UPRIGHT: Final = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""From the simulation's axes, z up, to those of glTF, y up."""


def robot_glb(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...] = ()) -> bytes:
    """Return the assembled robot as binary glTF in metres, y up: servos off, floating, as a maker holds it.

    Nodes of the scene are called by the numbers of the build sheet: ``module1_rod0``, ``module1_cable_0_4``.
    """
    scene = _Scene()
    frames = _rod_frames(morphology)
    length = 1e3 * t.ROD_LENGTH
    scene.shape(
        "rod", solids.cylinder(1e3 * t.ROD_RADIUS, 1e3 * CAP_TIP, length - 1e3 * CAP_TIP, segments=16)
    )
    scene.shape("rod", _halves(materials), name="servo_rod")
    scene.shape("cable", Manifold.cylinder(1.0, 1.0, 1.0, 8))
    scene.shape("line", Manifold.cylinder(1.0, 1.0, 1.0, 6))
    scene.shape("mount", sp.servo_mount(materials))
    scene.shape("servo", sp.servo_body(materials.servo))
    scene.shape("drum", drum.drum_in_place(materials.servo))
    scene.shape("ballast", sp.ballast(materials))
    for node in t.SERVO_NODES:
        drum_end, arm, ball = sp.line_path(materials.servo, node)
        thin = 500 * materials.line.diameter
        way = solids.bar(drum_end, arm, thin, segments=6) + solids.bar(arm, ball, thin, segments=6)
        scene.shape("line", way, name=f"way_{node}")
    designs = design_cables(morphology, materials)
    for level in sorted({d.level for d in designs}):
        design = next(d for d in designs if d.level == level)
        cap = shapes.cap(design, materials.printer, footed=bool(feet))
        scene.shape("cap", cap, name=f"cap_{level}")
    for lean in sorted({f.lean for f in feet}):
        scene.shape("foot", foot(lean), name=f"foot_{lean}")
    worn = {(f.module, f.node): f for f in feet}
    nodes = []
    for i, (rotation, centre, points) in enumerate(frames):
        nodes.append(points)
        m = f"module{t.module_number(i)}"
        for r, (a, b) in enumerate(t.RODS):
            axis = points[b] - points[a]
            towards = centre - points[[a, b]].mean(axis=0)
            kind = "servo_rod" if r == t.SERVO_ROD else "rod"
            scene.add(kind, f"{m}_rod{r}", solids.frame_along(axis), points[a])
            for node, sign in ((a, -1.0), (b, 1.0)):
                frame = solids.frame_along(sign * axis, towards)
                scene.add(f"cap_{designs[i].level}", f"{m}_cap_{node}", frame, points[node])
                if own := worn.get((i, node)):
                    turned = frame @ solids.turn_about_z(-own.clock)
                    # drawn for the lowest cap
                    place = points[node] + (shapes.post_top(designs[i]) - shapes.POST_TOP) * frame[:, 2]
                    scene.add(f"foot_{own.lean}", f"{m}_foot_{node}", turned, place)
        width = 500 * designs[i].section.area ** 0.5
        for a, b in t.CABLES:
            scene.add_bar("cable", f"{m}_cable_{a}_{b}", points[a], points[b], width)
        a, b = t.RODS[t.SERVO_ROD]
        middle = points[[a, b]].mean(axis=0)
        for name in ("mount", "servo", "drum", "ballast"):
            scene.add(name, f"{m}_{name}", rotation, middle)
        guide = middle + rotation @ sp.guide_point()
        for node in t.SERVO_NODES:
            scene.add(f"way_{node}", f"{m}_way_{node}", rotation, middle)
            scene.add_bar("line", f"{m}_servo_{node}", guide, points[node], 500 * materials.line.diameter)
    scene.shape("link", Manifold.cylinder(1.0, 1.0, 1.0, 8))
    for i in range(morphology.n_modules - 1):
        face = t.FACES[morphology.faces[i]]
        opposite = t.FACES[t.OPPOSITE_FACE[morphology.faces[i + 1]]]
        for k, (a, b) in enumerate(t.JOINT_ORDER, start=1):
            name = f"link{t.module_number(i)}_{k}"
            scene.add_bar("link", name, nodes[i][face[a]], nodes[i + 1][opposite[b]], 1.0)
    return scene.glb()


def _halves(materials: Materials) -> Manifold:
    """Return both pieces of the servo rod along z, its first node at 0."""
    left, right = (1e3 * length for length in sp.half_rods(materials))
    low, high = 1e3 * CAP_TIP, 1e3 * (t.ROD_LENGTH - CAP_TIP)
    radius = 1e3 * t.ROD_RADIUS
    return solids.cylinder(radius, low, low + left, segments=16) + solids.cylinder(
        radius, high - right, high, segments=16
    )


@functools.lru_cache(maxsize=64)
def servo_clearance(level: int, materials: Materials) -> float:
    """Return the least gap in mm between a servo with mount and drum and the module's other rods.

    Checked with the servo off, and from released to fully contracted in four steps, in a floating module;
    negative if they would touch.
    """
    still = sp.servo_body(materials.servo) + sp.servo_mount(materials) + sp.ballast(materials)
    gap = 50.0
    for command in (None, 0, 60, 120, CONTRACTED):
        body = still + drum.drum_in_place(materials.servo, command or 0.0)
        nodes = 1e3 * floating_module(level, command).nodes
        rotation, middle = _servo_frame(nodes)
        for r, (a, b) in enumerate(t.RODS):
            if r == t.SERVO_ROD:
                continue
            ends = (nodes[[a, b]] - middle) @ rotation
            rod = solids.bar(ends[0], ends[1], 1e3 * t.ROD_RADIUS)
            near = float(body.min_gap(rod, gap))
            if near == 0.0:
                return -(float((body ^ rod).volume()) ** (1 / 3))
            gap = min(gap, near)
    return gap


def _servo_frame(nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the servo rod's frame: (3, 3) with x to the module's centre and y along the rod; its middle."""
    a, b = nodes[list(t.RODS[t.SERVO_ROD])]
    y = (b - a) / np.linalg.norm(b - a)
    middle = (a + b) / 2
    x = nodes.mean(axis=0) - middle
    x = x - y * (x @ y)
    x = x / np.linalg.norm(x)
    return np.stack([x, y, np.cross(x, y)], axis=1), middle


def _rod_frames(morphology: Morphology) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return for each module the servo rod's rotation, centre (3,) and nodes (12, 3) at rest, in mm."""
    robot = build_robot(morphology, Physics(), gravity=False)
    data = mujoco.MjData(robot.model)
    data.ctrl[:] = 1.0
    mujoco.mj_step(robot.model, data, round(HOLD / robot.model.opt.timestep))
    mujoco.mj_forward(robot.model, data)
    result = []
    for i in range(morphology.n_modules):
        points = []
        for n, node in enumerate(t.NODES):
            body = robot.rod_bodies[i, t.rod_of(n)]
            half = (node - t.NODES[n ^ 1]) / 2
            points.append(1e3 * (data.xpos[body] + data.xmat[body].reshape(3, 3) @ half))
        nodes = np.array(points)
        rotation, _ = _servo_frame(nodes)
        result.append((rotation, nodes.mean(axis=0), nodes))
    return result


class _Scene:
    """Collects shapes once and places them many times. Shapes and positions in mm, the file in metres."""

    def __init__(self) -> None:
        self._scene = trimesh.Scene()
        self._shapes: dict[str, Any] = {}

    def shape(self, kind: str, solid: Manifold, *, name: str | None = None) -> None:
        vertices, faces = solids.triangles(solid)
        mesh = trimesh.Trimesh(vertices=1e-3 * vertices, faces=faces, process=False)
        material = PBRMaterial(
            name=kind, baseColorFactor=_COLOURS[kind], metallicFactor=0.0, roughnessFactor=0.7
        )
        mesh.visual = trimesh.visual.TextureVisuals(material=material)
        self._shapes[name or kind] = mesh

    def add(self, shape: str, node: str, rotation: np.ndarray, position: np.ndarray) -> None:
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = 1e-3 * position
        if shape in self._scene.geometry:
            self._scene.graph.update(frame_to=node, matrix=matrix, geometry=shape)
        else:
            self._scene.add_geometry(self._shapes[shape], geom_name=shape, node_name=node, transform=matrix)

    def add_bar(self, shape: str, node: str, a: np.ndarray, b: np.ndarray, radius: float) -> None:
        """Place a unit cylinder from a to b."""
        frame = solids.frame_along(b - a)
        self.add(shape, node, frame * np.array([radius, radius, np.linalg.norm(b - a)]), a)

    def glb(self) -> bytes:
        """Return the file; up is y in glTF, z in the simulation."""
        self._scene.apply_transform(_UPRIGHT)
        return bytes(self._scene.export(file_type="glb"))

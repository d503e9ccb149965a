import io
import itertools
import xml.etree.ElementTree as ET
import zipfile

import numpy as np
import pytest
import trimesh

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.fabrication.bill_of_materials import parts, simulated_mass
from engine.fabrication.buildability import problems
from engine.fabrication.dimensions.cables import EYELET_WALL, design_cables
from engine.fabrication.dimensions.floating_module import floating_module
from engine.fabrication.folder import fabrication_files
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import PRESETS, load_materials, parse_materials, preset_text
from engine.fabrication.parts import printed_parts as p
from engine.fabrication.parts import servo_parts as sp
from engine.fabrication.parts import shapes, solids
from engine.fabrication.parts.assembly import robot_glb, servo_clearance
from engine.fabrication.parts.mesh_files import stl_bytes, threemf_bytes

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials()
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


@pytest.fixture(scope="module")
def printed():
    return p.printed_parts(BODY, MATERIALS)


@pytest.mark.parametrize("name", PRESETS)
def test_every_part_is_one_closed_body_that_can_be_printed(name):
    materials = load_materials(name)
    for part in p.printed_parts(BODY, materials):
        mesh = trimesh.load(io.BytesIO(stl_bytes(part.solid, part.name)), file_type="stl")
        assert mesh.is_watertight, part.name
        assert mesh.is_winding_consistent
        assert len(part.solid.decompose()) == 1
        assert mesh.volume == pytest.approx(1e9 * part.volume, rel=1e-3)
        assert mesh.volume > 0
        assert (part.fits, part.walls_hold) == (True, True), part.name
        assert mesh.bounds[0] == pytest.approx([0, 0, 0], abs=1e-3)
        assert mesh.extents == pytest.approx(1e3 * np.array(part.size), abs=1e-3)


def test_a_part_too_large_or_too_thin_is_told():
    text = preset_text("tpu-85a").replace("bed_x_mm = 220", "bed_x_mm = 100")
    text = text.replace("min_wall_mm = 0.8", "min_wall_mm = 1.3")
    found = problems(Morphology(3, (1, 2)), parse_materials(text, file="mine.toml"))
    texts = " ".join(problem.text for problem in found)
    assert "net_stiffness_0.3" in texts
    assert "does not fit the bed of 100 x 220 x 220 mm" in texts
    assert "link" not in texts
    assert "walls thinner than 1.3 mm" in texts
    assert all(problem.proposals for problem in found)
    assert problems(BODY, MATERIALS) == ()


def test_thin_walls_are_measured():
    plate = solids.box((0, 0, 0), (10, 10, 2)) - solids.box((1, 1, -1), (9, 4.2, 3))
    plate = plate - solids.box((1, 4.7, -1), (9, 9, 3))
    # a bar of 8 x 0.5 mm is left standing between the two windows
    assert solids.thin_area(plate, 0.4) < 0.02
    assert solids.thin_area(plate, 0.8) == pytest.approx(8 * 0.5, rel=0.15)


def test_3mf_says_millimetre_and_holds_the_same_body(printed):
    for part in printed:
        content = threemf_bytes(part.solid, part.name)
        with zipfile.ZipFile(io.BytesIO(content)) as package:
            assert "[Content_Types].xml" in package.namelist()
            model = ET.fromstring(package.read("3D/3dmodel.model"))
        assert model.get("unit") == "millimeter"
        vertices = [[float(v.get(k)) for k in "xyz"] for v in model.iter(f"{CORE}vertex")]
        faces = [[int(f.get(k)) for k in ("v1", "v2", "v3")] for f in model.iter(f"{CORE}triangle")]
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(1e9 * part.volume, rel=1e-3)


def test_the_net_weighs_what_its_cables_and_rings_do(printed):
    design = design_cables(BODY, MATERIALS)[0]
    net = next(part for part in printed if part.name == "net_stiffness_0.3")
    cables = 24 * design.section.area * design.free
    rings = 15 * np.pi * (0.00135 + EYELET_WALL) ** 2 * 0.0012 - 15 * np.pi * 0.00135**2 * 0.0012
    assert net.volume == pytest.approx(cables + rings, rel=0.03)


def test_a_cap_leads_the_cables_to_the_simulated_anchors():
    design = design_cables(BODY, MATERIALS)[0]
    cap = shapes.cap(design, MATERIALS.printer)
    low, high = cap.bounding_box()[2], cap.bounding_box()[5]
    assert low == pytest.approx(-1e3 * design.tail)
    assert high < 3.0
    # the rod goes in up to the solid tip
    rod = solids.cylinder(1e3 * t.ROD_RADIUS, low - 5, -1.5)
    assert (cap ^ rod).volume() == 0
    for angle in shapes.notch_angles():
        direction = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
        # in the node's plane a cable may come as near as the anchor, but no nearer
        r = 1e3 * t.ANCHOR_OFFSET
        free = solids.bar((r + 0.3) * direction, 6 * direction, 0.25)
        assert (cap ^ free).volume() < 1e-3
        assert (cap ^ solids.bar([0, 0, 0], (r - 0.1) * direction, 0.25)).volume() > 0.05


def test_notches_point_along_the_cables_at_every_node():
    nodes = floating_module(5, None).nodes
    for n in range(12):
        axis = nodes[n] - nodes[n ^ 1]
        frame = solids.frame_along(axis, -(nodes[n] + nodes[n ^ 1]) / 2)
        others = [b if a == n else a for a, b in t.CABLES if n in (a, b)]
        local = (nodes[others] - nodes[n]) @ frame
        angles = np.sort(np.degrees(np.arctan2(local[:, 1], local[:, 0])) % 360)
        assert angles == pytest.approx(shapes.notch_angles(), abs=0.5)


def test_the_drum_winds_the_strokes_of_the_simulated_table():
    radii = sp.groove_radii(MATERIALS.servo)
    assert np.pi * radii == pytest.approx(1e3 * (servo.TARGET_LENGTHS[0] - servo.TARGET_LENGTHS[180]))
    assert sp.drum_errors(MATERIALS.servo).max() < 3.6
    drum = sp.servo_drum(MATERIALS.servo)
    for k, node in enumerate(sp.drum_order(MATERIALS.servo)):
        z = sp.FLANGE + k * (sp.FLANGE + sp.GROOVE) + sp.GROOVE / 2
        section = drum.slice(z)
        r = radii[t.SERVO_NODES.index(node)]
        assert max(section.bounds()) == pytest.approx(r, abs=0.02)


def test_servo_mount_and_drum_have_room():
    motor = MATERIALS.servo
    mount, body = sp.servo_mount(motor, MATERIALS.printer), sp.servo_body(motor)
    drum = sp.drum_in_place(motor)
    rod = solids.bar((0, -41, 0), (0, 41, 0), 1e3 * t.ROD_RADIUS)
    for a, b in itertools.combinations((mount, body, drum, rod), 2):
        assert (a ^ b).volume() < 1e-6
    for level in (1, 5, 10):
        assert servo_clearance(level, MATERIALS) > 0.9
        nodes = 1e3 * floating_module(level, 180).nodes
        a, b = nodes[0], nodes[1]
        y = (b - a) / np.linalg.norm(b - a)
        x = -(a + b) / 2
        x = (x - y * (x @ y)) / np.linalg.norm(x - y * (x @ y))
        frame = np.stack([x, y, np.cross(x, y)], axis=1)
        for node in t.SERVO_NODES:
            # no internal cable cuts through the servo on its way
            end = (nodes[node] - (a + b) / 2) @ frame
            towards = (end - sp.guide_point()) / np.linalg.norm(end - sp.guide_point())
            line = solids.bar(sp.guide_point() + 4.2 * towards, end, 0.15)
            assert all((solid ^ line).volume() == 0 for solid in (mount, body, drum))


def test_guide_holes_leave_the_ball_whole():
    holes = [sp.guide_direction(node) for node in t.SERVO_NODES]
    for a, b in itertools.combinations([*holes, sp.line_entry(MATERIALS.servo)], 2):
        apart = 1e3 * t.ACTUATOR_RADIUS * np.linalg.norm(a - b)
        assert apart > 1.2 + 0.8


def test_the_servo_rods_centre_of_mass_is_told():
    box = solids.box((1, 2, 3), (5, 4, 4)) + solids.box((11, 2, 3), (15, 4, 4))
    assert solids.centroid(box) == pytest.approx([8, 3, 3.5])
    centre = sp.servo_rod_centre_of_mass(MATERIALS, 0.0015)
    far = np.linalg.norm(centre - np.array(t.SERVO_ROD_CENTRE_OF_MASS))
    line = next(x for x in mass_balance(BODY, MATERIALS).lines if x.group == "servo rod")
    assert f"lies {1e3 * far:.0f} mm off the simulated one" in line.explanation
    # the heavy servo lies on the quarter where its axis is
    assert np.sign(centre[1:]) == pytest.approx(np.sign(sp.SERVO_AXIS))


@pytest.mark.parametrize("name", PRESETS)
def test_masses_add_up_to_the_simulated_one(name):
    materials = load_materials(name)
    listed = parts(BODY, materials)
    balance = mass_balance(BODY, materials)
    carried = sum(part.quantity * part.mass for part in listed if part.group != "off the robot")
    assert balance.built == pytest.approx(carried)
    assert balance.simulated == pytest.approx(simulated_mass(BODY))
    assert balance.simulated == pytest.approx(2 * (0.020 + 5 * 0.001003))
    assert balance.built - balance.simulated == pytest.approx(balance.excess, abs=1e-9)
    # either ballast fills a module up, or it is too heavy already
    assert (balance.ballast == 0) != (balance.excess == 0)
    assert all(line.explanation for line in balance.lines)
    assert abs(balance.excess) < 0.3 * balance.simulated


def test_the_scene_is_the_robot_in_metres():
    scene = trimesh.load(io.BytesIO(robot_glb(BODY, MATERIALS)), file_type="glb")
    names = set(scene.graph.nodes_geometry)
    assert {f"m{i}_rod{r}" for i in (0, 1) for r in range(6)} <= names
    assert {f"m{i}_cable_{a}_{b}" for i in (0, 1) for a, b in t.CABLES} <= names
    assert {"m0_servo", "m1_drum", "link0_2"} <= names
    assert 0.12 < max(scene.extents) < 0.2
    # a rod reaches from node to node but for its caps' tips
    matrix, geometry = scene.graph["m1_rod3"]
    rod = scene.geometry[geometry].copy().apply_transform(matrix)
    longest = np.linalg.norm(rod.vertices[:, None] - rod.vertices, axis=-1).max()
    assert longest == pytest.approx(0.079, abs=2e-4)
    # joined nodes are near each other
    for k in range(3):
        matrix, _ = scene.graph[f"link0_{k}"]
        # the matrix stretches a cylinder of 1 mm
        assert 1e-3 * np.linalg.norm(matrix[:3, 2]) < 0.004


def test_equal_robots_give_equal_files():
    first = fabrication_files(BODY, MATERIALS)
    p.printed_parts.cache_clear()
    assert fabrication_files(BODY, MATERIALS) == first
    assert {
        "robot.glb",
        "cables.csv",
        "rods.csv",
        "joints.csv",
        "bill_of_materials.csv",
        "parts/net_stiffness_0.3.stl",
        "parts/cap_stiffness_0.9.3mf",
        "net/net_stiffness_0.9.dxf",
        "net/net_stiffness_0.3.svg",
    } <= set(first)

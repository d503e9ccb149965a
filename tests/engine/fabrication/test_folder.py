import csv
import io

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.folder import fabrication_files
from engine.fabrication.materials import load_materials
from engine.fabrication.parts.printed_parts import printed_parts
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials("tpu-85a")


def test_tables_number_modules_from_1_and_name_what_the_model_calls_them():
    files = {
        name: list(csv.DictReader(io.StringIO(content.decode())))
        for name, content in fabrication_files(BODY, MATERIALS).items()
        if name in ("cables.csv", "rods.csv", "joints.csv")
    }
    model = build_robot(BODY, Physics()).model
    for row in files["cables.csv"]:
        name = f"m{int(row['module']) - 1}_cable_{row['node_a']}_{row['node_b']}"
        assert row["name_in_robot_xml"] == name == model.tendon(name).name
    for row in files["rods.csv"]:
        name = f"m{int(row['module']) - 1}_rod{row['rod']}"
        assert row["name_in_robot_xml"] == name == model.body(name).name
    assert [(row["module"], row["next_module"]) for row in files["joints.csv"]] == [("1", "2")]


def test_equal_robots_give_equal_files():
    first = fabrication_files(BODY, MATERIALS)
    printed_parts.cache_clear()
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


def test_feet_have_a_table_and_parts():
    worn = Foot(
        number=1, module=1, node=6, lean=60, clock=130, share=0.5, forward=0.1, backward=0.02, off=7.0
    )
    files = fabrication_files(BODY, MATERIALS, (worn,))
    header, row = files["feet.csv"].decode().split()
    assert header.startswith("foot,module,node,part,clock_degrees")
    # people count modules from 1
    assert row == "1,2,6,foot_060,130,50.0,10.00,2.00,7"
    assert {"parts/foot_060.stl", "parts/foot_090.3mf", "parts/friction_sled.stl"} <= set(files)
    assert b"foot_060" in files["bill_of_materials.csv"]
    assert "feet.csv" not in fabrication_files(BODY, MATERIALS)

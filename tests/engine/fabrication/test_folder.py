from engine.body.morphology import Morphology
from engine.fabrication.folder import fabrication_files
from engine.fabrication.materials import load_materials
from engine.fabrication.parts.printed_parts import printed_parts

BODY = Morphology((3, 9), (1, 2))
MATERIALS = load_materials("tpu-85a")


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

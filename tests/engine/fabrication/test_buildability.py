from engine.body.morphology import Morphology
from engine.fabrication.buildability import problems
from engine.fabrication.materials import load_materials, parse_materials, preset_text

BODY = Morphology((3, 9), (1, 2))


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


def test_the_default_can_be_built():
    assert problems(BODY, load_materials()) == ()

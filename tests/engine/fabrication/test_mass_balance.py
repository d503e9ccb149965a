import pytest

from engine.body.morphology import Morphology
from engine.fabrication.bill_of_materials import parts, simulated_mass
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import PRESETS, load_materials

BODY = Morphology((3, 9), (1, 2))


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
    # the counterweight fills up the servo's rod alone, whatever cables weigh
    own = next(line for line in balance.lines if line.group == "servo rod")
    assert own.built == pytest.approx(own.simulated, rel=0.03)
    assert balance.ballast > 0.005
    assert all(line.explanation for line in balance.lines)
    assert abs(balance.excess) < 0.3 * balance.simulated

"""The simulation whose outcome is known."""

import json

from engine.simulation import self_check


def test_the_known_simulation_comes_out_as_recorded():
    found = self_check.compare()
    # after a change of the physics: python -m engine.simulation.self_check
    assert found.same_body
    assert found.good, found


def test_a_wrong_outcome_is_noticed(tmp_path, monkeypatch):
    known = json.loads(self_check.FILE.read_text())
    known["distances"][0][0] += 1e-3
    monkeypatch.setattr(self_check, "FILE", tmp_path / "known.json")
    (tmp_path / "known.json").write_text(json.dumps(known))
    assert not self_check.compare().good

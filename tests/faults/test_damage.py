"""A few of the copies of ``python -m benchmarks.damage``."""

from benchmarks.damage import READINGS, damaged, try_copies


def test_what_a_damaged_file_gives_is_what_was_written_or_a_line(tmp_path):
    counts, faults = try_copies(range(5000, 5060), tmp_path)
    assert not faults
    for name in READINGS:
        # each was told whole, some were refused
        assert counts[f"{name}: as written"] + counts[f"{name}: refused"] == 61
        assert counts[f"{name}: refused"] > 5


def test_every_damage_is_one():
    content = bytes(range(256)) * 16 * 3
    for number in range(200):
        found, where = damaged(content, number)
        assert len(found) == len(content)
        assert where
        if "now like" not in where:
            assert found != content
        assert damaged(content, number) == (found, where)

"""The house: how large its rooms are, and that a stranger finds every module from a room's docstring."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MOST_IN_A_ROOM = 14
MOST_AT_THE_TOP = {"engine": 6, "app": 4, "viz": 2}
ROOMS = sorted(
    p.parent.relative_to(ROOT) for top in MOST_AT_THE_TOP for p in (ROOT / top).glob("*/**/__init__.py")
)


def modules(room):
    return sorted(p.stem for p in (ROOT / room).glob("*.py") if p.stem != "__init__")


@pytest.mark.parametrize(("top", "most"), MOST_AT_THE_TOP.items())
def test_few_modules_lie_outside_a_room(top, most):
    assert len(set(modules(top)) - {"__main__"}) <= most


@pytest.mark.parametrize("room", ROOMS, ids=str)
def test_a_room_is_small_and_its_docstring_names_what_it_holds(room):
    names = modules(room)
    assert len(names) <= MOST_IN_A_ROOM
    docstring = ast.get_docstring(ast.parse((ROOT / room / "__init__.py").read_text())) or ""
    inner = [p.parent.name for p in (ROOT / room).glob("*/__init__.py")]
    unnamed = [n for n in names if f"``{n}``" not in docstring]
    unnamed += [f"{n}/" for n in inner if f"``{n}/``" not in docstring]
    assert not unnamed, f"{room}/__init__.py does not say what {', '.join(unnamed)} is for"


def test_every_folder_of_modules_is_a_room():
    folders = {p.parent for top in MOST_AT_THE_TOP for p in (ROOT / top).rglob("*.py")}
    folders -= {p for p in folders if "data" in p.parts}
    assert [str(p.relative_to(ROOT)) for p in sorted(folders) if not (p / "__init__.py").exists()] == []


def test_the_top_holds_no_other_package():
    packages = {p.parent.name for p in ROOT.glob("*/*.py")} - {"tests", "benchmarks"}
    assert packages == set(MOST_AT_THE_TOP)

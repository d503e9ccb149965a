"""The page of a run: what it holds, how exactly, and that nothing of a stranger's run gets loose in it."""

import base64
import contextlib
import html.parser
import json
import re
import sqlite3
import zlib

import numpy as np
import pytest

from engine.errors import ExportError, InvalidData
from engine.replay.every_target import replay_every_target
from engine.storage.reader import RunReader
from tests.support.evaluated_again import evaluated_again
from tests.support.run_formats import in_format
from tests.support.unpacked import unpack
from viz.atlas.elites import DETAIL, updates_per_frame
from viz.atlas.page import atlas_page, checked_link
from viz.atlas.shown import what_to_show
from viz.robot.skeleton import posed

HOSTILE = "<script>alert(1)<'\"&>@robots@"


@pytest.fixture(scope="module")
def page(small_run):
    with RunReader(small_run) as reader:
        return atlas_page(reader, link="https://example.org/run?a=1&b=2", n_threads=2).decode()


def element(page, name):
    return re.search(rf'<script type="[^"]*" id="{name}">(.*?)</script>', page, re.S)[1]


def robot(page, number):
    """Return what the page says of a robot, and its columns by trial."""
    content = base64.b64decode(element(page, f"r{number}"))
    end = 4 + int.from_bytes(content[:4], "little")
    data = json.loads(zlib.decompress(content[4:end]))
    scene = data["scene"]
    n = scene["modules"] * (3 * scene["points"] + scene["told"])
    return data, unpack(content[end:], [t["frames"] for t in scene["trials"]], n)


def test_it_holds_the_elites_of_all_maps(page, small_reader):
    data = json.loads(element(page, "atlas"))
    last = small_reader.last_generation()
    held = set()
    for archive in ("morphology", "controller"):
        placed = small_reader.placements(archive, last)
        assert data["maps"][archive] == {",".join(map(str, cell)): n for cell, n in placed.items()}
        held |= set(placed.values())
    assert set(map(int, data["robots"])) == held
    assert set(map(int, re.findall(r'id="r(\d+)"', page))) == held
    best = min(small_reader.evaluations(held).values(), key=lambda e: e.fitness)
    assert data["best"] == best.solution.number
    said, _ = robot(page, data["best"])
    assert said["words"] == f"{abs(said['f_s']):.1f} cm {'closer' if said['f_s'] > 0 else 'farther'}"
    assert said["f_s"] == pytest.approx(45 - 100 * best.fitness, abs=0.01)
    assert [t["gain"] for t in said["targets"]] == pytest.approx(
        list(45 - 100 * best.distances.mean(axis=1)), abs=0.01
    )
    line = small_reader.lineage(data["best"])
    assert [row[0] for row in said["lineage"]] == [a.number for a in line]
    assert 'href="https://example.org/run?a=1&amp;b=2"' in page
    assert "the best robot of its body: how many modules, and how stiff.</p>" in page


def test_no_point_is_off_by_more_than_a_fifth_of_a_millimetre(page, small_reader):
    config = small_reader.config
    data = json.loads(element(page, "atlas"))
    evaluations = list(small_reader.evaluations(set(map(int, data["robots"]))).values())
    updates = updates_per_frame(config.physics.control_period)
    worst = 0.0
    for evaluation, trials in replay_every_target(config, evaluations, updates_per_frame=updates):
        said, columns = robot(page, evaluation.solution.number)
        scene = said["scene"]
        assert [t["trial"] for t in said["targets"]] == list(range(len(trials)))
        for trial, read in zip(trials, columns, strict=True):
            points = posed(trial.poses)[0].reshape(len(trial.poses), -1, 3)
            places = read[:, : 3 * points.shape[1]].reshape(points.shape)
            off = np.linalg.norm(scene["origin"] + scene["step"] * places - points, axis=-1)
            worst = max(worst, off.max())
    assert scene["step"] == DETAIL.step
    assert 0.5e-4 < worst < 2e-4
    assert re.search(r"no point of a robot is more than 0\.(1\d|20) mm", page)


class Loose(html.parser.HTMLParser):
    """Notes what a browser would run or load."""

    def __init__(self):
        super().__init__()
        self.scripts, self.handlers, self.addresses = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag == "script":
            self.scripts.append(dict(attrs).get("type"))
        for name, value in attrs:
            if name.startswith("on"):
                self.handlers.append(name)
            if name in ("src", "href"):
                self.addresses.append(value)


def test_a_hostile_run_stays_text(small_run, tmp_path):
    path = in_format(small_run, tmp_path / f"{HOSTILE}.tsmr", 1)
    with contextlib.closing(sqlite3.connect(path)) as db, db:
        for key, value in (("versions", {"tensatlas": HOSTILE}), ("created_at", HOSTILE)):
            db.execute("UPDATE meta SET value = ? WHERE key = ?", (json.dumps(value), key))
        for generation, archives in db.execute("SELECT generation, archives FROM generations").fetchall():
            named = archives.replace('"controller"', json.dumps(HOSTILE))
            db.execute("UPDATE generations SET archives = ? WHERE generation = ?", (named, generation))
        db.execute("UPDATE placements SET archive = ? WHERE archive = 'controller'", (HOSTILE,))
        db.execute("UPDATE evaluations SET operator = ? WHERE parent IS NOT NULL", (HOSTILE,))
        # it was interrupted in its last generation, whose robots have been tried all the same
        for table in ("placements", "generations"):
            db.execute(f"DELETE FROM {table} WHERE generation = (SELECT MAX(generation) FROM generations)")
    with RunReader(path) as reader:
        assert reader.versions["tensatlas"] == reader.created_at == HOSTILE
        made = atlas_page(reader, link="https://example.org/\"onclick='x'").decode()
        assert reader.finished_generation().n_evaluations < reader.n_evaluations() == 18
    assert "· 18 robots tried ·" in made
    parsed = Loose()
    parsed.feed(made)
    robots = len(re.findall(r'id="r\d+"', made))
    assert parsed.scripts == ["application/json", "text/plain", None, *["text/plain"] * (robots - 1)]
    assert parsed.handlers == []
    assert set(parsed.addresses) == {"https://example.org/\"onclick='x'"}
    assert HOSTILE not in made.replace(json.dumps(HOSTILE), "")
    assert "script-src 'sha256-" in made


@pytest.mark.parametrize(
    "link",
    [
        "javascript:alert(1)",
        "example.org",
        "ftp://example.org",
        "https://",
        "https://a b.org",
        "http://[",
        "x" * 9,
    ],
)
def test_a_link_leads_to_a_web_page(link):
    with pytest.raises(InvalidData, match="link must be the address of a web page"):
        checked_link(link)
    assert checked_link("https://doi.org/10.1000/182") == "https://doi.org/10.1000/182"
    assert checked_link("") == ""


def test_equal_runs_make_equal_pages(page, small_reader):
    again = atlas_page(small_reader, link="https://example.org/run?a=1&b=2", n_threads=1)
    assert again.decode() == page


def test_a_grid_is_shown_on_both_maps(grid_reader):
    ((name, maps),) = what_to_show(grid_reader).maps.items()
    assert name == "fitness f_s"
    assert [p.view.name for p in maps] == ["grid-01", "grid-23"]


def test_it_opens_with_the_most_reliable_robot_even_if_a_projected_map_hides_it(grid_run, tmp_path):
    path, number = evaluated_again(grid_run, tmp_path)
    with RunReader(path) as reader:
        shown = what_to_show(reader)
        ((cell, _),) = [
            f for f in reader.elites(reader.finished_generation())["grid"].items() if f[1][0] == number
        ]
    assert list(shown.maps) == ["robust fitness", "fitness f_s"]
    on_maps = {e.number for maps in shown.maps.values() for p in maps for e in p.elites.values()}
    assert number not in on_maps
    assert shown.best.number == number
    assert set(shown.robots) == on_maps | {number}
    assert shown.cells[number] == {"Grid": ",".join(map(str, cell))}
    for picture in shown.maps["robust fitness"]:
        assert list(picture.values.values()) == pytest.approx([-15.0] * len(picture.elites))
        assert picture.scale.title == "robust f_s cm"


def test_a_run_without_elites_says_so(small_run, tmp_path):
    path = in_format(small_run, tmp_path / "bare.tsmr", 1)
    with contextlib.closing(sqlite3.connect(path)) as db, db:
        db.execute("DELETE FROM placements")
    with RunReader(path) as reader, pytest.raises(ExportError, match=r"bare\.tsmr has no elites to show"):
        atlas_page(reader)

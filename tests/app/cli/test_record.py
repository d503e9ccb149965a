"""The command ``record``."""

from pathlib import Path

import pytest

from app.cli.main import main


def record(capsys, *arguments):
    """Return exit status and standard error of the command."""
    status = 0
    try:
        main(["record", *map(str, arguments)])
    except SystemExit as e:
        status = int(e.code or 0)
    return status, capsys.readouterr().err


@pytest.fixture
def cell(small_reader):
    """A filled cell of the morphology map, and its robot."""
    placed = small_reader.placements("morphology", small_reader.last_closed().number)
    found, number = min(placed.items(), key=lambda item: item[0])
    return ",".join(map(str, found)), number


def test_a_replay_becomes_a_file_of_the_kind_that_its_name_says(small_run, cell, tmp_path, capsys):
    for name, start in (("a.html", b"<!doctype html>"), ("b/c.PNG", b"\x89PNG"), ("d.mp4", None)):
        out = tmp_path / name
        arguments = (small_run, "--cell", cell[0], "--out", out, "--target", 4, "--speed", 10)
        assert record(capsys, *arguments) == (0, f"Wrote robot {cell[1]} to {out}\n")
        content = out.read_bytes()
        assert content.startswith(start) if start else content[4:8] == b"ftyp"
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert f"Robot {cell[1]} of small" in page
    assert f"morphology cell {cell[0]}" in page


def test_a_trial_may_have_noise_and_a_target_of_its_own(small_run, cell, tmp_path, capsys):
    out = tmp_path / "a.html"
    arguments = (small_run, "--cell", cell[0], "--out", out, "--fresh", 7, "--aim", "-30,62")
    assert record(capsys, *arguments)[0] == 0
    page = out.read_text(encoding="utf-8")
    assert "30° right, 62 cm" in page
    assert "fresh noise 7" in page


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--out", "a.gif"), "a recording's name ends in .mp4, .png or .html"),
        (("--out", "a.html", "--target", "0"), "target must be from 1 to 4, not 0"),
        (("--out", "a.html", "--target", "5"), "target must be from 1 to 4, not 5"),
        (("--out", "a.html", "--repeat", "2"), "repeat must be from 1 to 1, not 2"),
        (("--out", "a.html", "--fresh", "-1"), "fresh noise must be from 1 to"),
        (("--out", "a.html", "--aim", "ahead"), "such as 30,62, not 'ahead'"),
        (("--out", "a.html", "--aim", "30,400"), "5 to 300 cm from where the head begins, not 400 cm"),
        (("--out", "a.mp4", "--speed", "0"), "speed must be from 0.1 to 20, not 0"),
        (("--out", "a.png", "--at", "3"), "at must be from -0.4 to 2 s, not 3"),
        (("--out", "a.png", "--archive", "grid"), "has no grid archive"),
        (("--out", "file/a.png"), "file/a.png cannot be written: "),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    small_run, cell, tmp_path, monkeypatch, capsys, arguments, says
):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("mine")
    status, err = record(capsys, small_run, "--cell", cell[0], *arguments)
    assert status == 2
    assert says in err
    assert err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_reading_a_run_does_not_change_it(small_run, cell, tmp_path, capsys):
    before = {p.name: p.read_bytes() for p in small_run.parent.iterdir()}
    assert record(capsys, small_run, "--cell", cell[0], "--out", tmp_path / "a.html")[0] == 0
    assert {p.name: p.read_bytes() for p in small_run.parent.iterdir()} == before


def page(capsys, *arguments):
    """Return exit status and standard error of the command ``page``."""
    status = 0
    try:
        main(["page", *map(str, arguments)])
    except SystemExit as e:
        status = int(e.code or 0)
    return status, capsys.readouterr().err


def test_a_run_becomes_a_page(small_run, tmp_path, capsys):
    before = {p.name: p.read_bytes() for p in small_run.parent.iterdir()}
    out = tmp_path / "atlas.html"
    status, err = page(capsys, small_run, "--out", out, "--link", "https://example.org", "--workers", 1)
    assert (status, err.splitlines()[-1]) == (0, f"Wrote {out}, {out.stat().st_size / 1e6:.1f} MB")
    assert out.read_bytes().startswith(b"<!doctype html>")
    assert {p.name: p.read_bytes() for p in small_run.parent.iterdir()} == before


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--out", "a.pdf"), "a.pdf: a page's name ends in .html"),
        (("--out", "gone/a.html"), "there is no folder gone; make it first"),
        (("--out", "file/a.html"), "there is no folder file; make it first"),
        (("--out", "a.html", "--link", "javascript:alert(1)"), "link must be the address of a web page"),
        (("--out", "a.html", "--workers", "0"), "workers"),
    ],
)
def test_no_page_is_begun_that_cannot_be_written(small_run, tmp_path, monkeypatch, capsys, arguments, says):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("mine")
    status, err = page(capsys, small_run, *arguments)
    assert status == 2
    assert says in err
    assert err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["file"]

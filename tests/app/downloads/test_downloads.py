"""The basket and the making of files, without a browser."""

import io
import json
import re
import threading
import time
import zipfile
from pathlib import Path

import pytest

from app.downloads.basket import (
    MOST,
    BasketItem,
    ExportChoice,
    added,
    export_basket,
    exported,
    folder_names,
)
from app.downloads.robot_folder import STEPS
from app.gui.actions import Actions
from app.gui.file_maker import FileMaker
from app.gui.lanes import Service
from engine.errors import ExportError, InvalidData
from engine.files import zip_bytes
from engine.storage.reader import RunReader
from viz.runs import basket_list


def item(number, path="runs/a.tsmr"):
    return BasketItem(Path(path), number, 3, 1.5, "morphology", (1, 2))


def test_a_robot_is_in_the_basket_once_and_runs_of_equal_names_are_told_apart():
    basket = added((), item(1))
    with pytest.raises(InvalidData, match="Robot 1 of a is in the basket already"):
        added(basket, item(1))
    basket = added(added(basket, item(2)), item(1, "other/a.tsmr"))
    assert folder_names(basket) == ["a_robot_1", "a_robot_2", "a_robot_1_2"]
    with pytest.raises(InvalidData, match="is full"):
        added([item(k) for k in range(MOST)], item(MOST))


def test_the_basket_exports_every_robot_in_a_folder_of_its_own(small_run):
    told = []
    with RunReader(small_run) as reader:
        done = [e.solution for e in reader.all_evaluations() if e.fitness is not None]
        # small ones: every robot is simulated, drawn and shaped
        numbers = [e.number for e in sorted(done, key=lambda e: e.morphology.n_modules)[:2]]
        basket = [item(n, str(small_run)) for n in numbers]
        choice = ExportChoice.of("Letter", "latex-sheet")
        files = export_basket(basket, lambda _: reader, lambda *a: told.append(a), choice)
    assert {name.split("/")[0] for name in files} == {f"small_robot_{n}" for n in numbers}
    assert all(f"small_robot_{n}/genotype.json" in files for n in numbers)
    for n in numbers:
        assert json.loads(files[f"small_robot_{n}/manifest.json"])["materials"] == choice.materials.name
        page = re.search(rb"/MediaBox *\[ *0 0 ([0-9.]+)", files[f"small_robot_{n}/build_sheet.pdf"])
        assert page is not None
        assert float(page[1]) == pytest.approx(8.5 * 72)
    assert [n for _, n, _ in told] == [*range(2 * STEPS), 2]
    assert {total for _, _, total in told[:-1]} == {2 * STEPS}
    assert told[0][0] == "robot 1 of 2, simulating"
    assert told[STEPS + 2][0] == "robot 2 of 2, parts"
    assert told[-1] == ("packing", 2, 2)
    with zipfile.ZipFile(io.BytesIO(zip_bytes(files, "basket"))) as packed:
        assert packed.testzip() is None


@pytest.mark.parametrize("step", range(STEPS))
def test_an_export_that_is_cancelled_ends_with_its_next_step(small_reader, step):
    class CancelledError(Exception):
        pass

    told = []

    def progress(doing, n, total):
        told.append(doing)
        if n == step:
            raise CancelledError

    choice = ExportChoice.of("A4", "tpu-85a")
    with pytest.raises(CancelledError):
        exported(item(0), small_reader, progress, choice)
    assert len(told) == step + 1


@pytest.mark.parametrize(
    ("paper", "material"),
    [("a4", "tpu-85a"), ("../x", "tpu-85a"), (None, "tpu-85a"), ("A4", "/etc/passwd"), ("A4", ["tpu-85a"])],
)
def test_what_is_not_on_offer_is_refused(paper, material):
    with pytest.raises(InvalidData, match="Choose a"):
        ExportChoice.of(paper, material)


def test_names_of_runs_are_text_in_the_list():
    shown = basket_list.render([("<b>&", 3, 2, None), ("a", 4, 10, -1.25)], "x()")
    assert "<b>&" not in shown.replace("<b>3", "")
    assert "&lt;b&gt;&amp;" in shown
    assert 'data-c="basket:1"' in shown
    assert "-1.2 cm" in shown
    assert "empty" in basket_list.render([], "x()")


class Widget:
    def __init__(self, value="", visible=True):
        self.value, self.content, self.visible = value, "", visible

    def on_click(self, clicked):
        self.clicked = clicked


class Notice:
    def __init__(self, shown):
        self.shown = shown
        shown.append(self)

    def remove(self):
        self.shown.remove(self)


class Browser:
    """What a file maker uses of a browser."""

    def __init__(self):
        self.gui, self.downloads, self.notices, self.loading = self, [], [], []

    def add_markdown(self, content, **options):
        return Widget(content, options["visible"])

    def add_progress_bar(self, value, **options):
        self.bar = Widget(value, options["visible"])
        return self.bar

    def add_button(self, label, **options):
        self.cancel = Widget(label, options["visible"])
        return self.cancel

    def send_file_download(self, name, content, **_options):
        self.downloads.append((name, content))

    def add_notification(self, title, body, *, loading=False, **_options):
        if loading:
            return Notice(self.loading)
        self.notices.append((title, body))
        return None


def finish(browser):
    deadline = time.monotonic() + 20
    while browser.bar.visible or browser.loading or not (browser.downloads or browser.notices):
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def browser():
    return Browser()


@pytest.fixture
def actions(browser):
    service = Service()
    yield Actions(browser, service.lanes())
    service.close(20)


def test_a_file_is_made_beside_everything_else_and_only_one_at_a_time(browser, actions):
    maker, go = FileMaker(browser, actions), threading.Event()

    def make(progress):
        progress("drawing", 1, 2)
        assert go.wait(20)
        return "a.txt", b"1"

    maker.start("a.txt", make)
    with pytest.raises(InvalidData, match="Another file is being made"):
        maker.start("b.txt", lambda _: ("b.txt", b"2"))
    deadline = time.monotonic() + 20
    while browser.bar.value != 50.0:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert browser.cancel.visible
    assert len(browser.loading) == 1
    go.set()
    finish(browser)
    assert browser.loading == []
    assert browser.downloads == [("a.txt", b"1")]
    browser.downloads.clear()
    maker.start("b.txt", lambda _: ("b.txt", b"2"))
    finish(browser)
    assert browser.downloads == [("b.txt", b"2")]


def test_what_is_cancelled_or_fails_sends_nothing_and_says_so(browser, actions):
    maker, begun = FileMaker(browser, actions), threading.Event()

    def endless(progress):
        while True:
            progress("drawing", 1, 2)
            begun.set()
            time.sleep(0.001)

    maker.start("a.txt", endless)
    assert begun.wait(20)
    browser.cancel.clicked(None)
    finish(browser)
    assert browser.notices == [("Cancelled", "No file was made of a.txt.")]
    assert browser.loading == []

    def fail(progress):
        raise ExportError("no disk")

    browser.notices.clear()
    maker.start("a.txt", fail)
    finish(browser)
    assert browser.notices == [("That did not work", "no disk")]
    assert browser.downloads == []

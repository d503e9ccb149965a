"""The pages for people are true: links lead somewhere, named files exist, command lines can be typed."""

from __future__ import annotations

import functools
import importlib
import itertools
import re
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.cli.main import COMMANDS, main

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "saved_archives" / "README.md",
]
FOLDERS = "engine|viz|app|tests|benchmarks|docs|saved_archives"
MODULE = re.compile(r"(engine|viz|app|benchmarks)(\.\w+)+")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)
SPAN = re.compile(r"`([^`]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
FLAG = re.compile(r"(?<![\w-])--[a-z][\w.-]*")
SHELL_COMMENT = re.compile(r"\s+#.*")
ASSIGNMENT = re.compile(r"[A-Z_]+=\S*")


def spans(text: str) -> list[str]:
    """Return what stands in backticks in the running text, a line break in it as a space."""
    return [" ".join(s.split()) for s in SPAN.findall(FENCE.sub("", text))]


def anchors(text: str) -> set[str]:
    """Return the anchors that GitHub gives to a page's headings."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", text), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def dead_links(page: Path, text: str) -> Iterator[str]:
    """Yield the relative links of a page that lead nowhere."""
    for link in LINK.findall(FENCE.sub("", text)):
        if re.match(r"\w+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        known = target == page or target.exists()
        if not known or (anchor and anchor not in anchors(text if target == page else target.read_text())):
            yield link


def unknown_files(text: str) -> Iterator[str]:
    """Yield what a page names of this project and what is not there: files, modules, make's targets."""
    targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    fenced = itertools.chain.from_iterable(block.splitlines() for _, block in FENCE.findall(text))
    for line in [*spans(text), *(SHELL_COMMENT.sub("", line) for line in fenced)]:
        for word in line.split():
            if re.fullmatch(rf"({FOLDERS})/[\w./-]*", word) and not (ROOT / word).exists():
                yield word
            if MODULE.fullmatch(word) and not is_importable(word):
                yield word
        if (make := re.match(r"make ([a-z]+)", line)) and make[1] not in targets:
            yield line


def is_importable(name: str) -> bool:
    """Tell whether a dotted name is a module, or something in one."""
    module, _, attribute = name.rpartition(".")
    if (ROOT / name.replace(".", "/")).is_dir() or (ROOT / f"{name.replace('.', '/')}.py").is_file():
        return True
    known = (ROOT / f"{module.replace('.', '/')}.py").is_file()
    return known and hasattr(importlib.import_module(module), attribute)


def typed(text: str) -> list[list[str]]:
    """Return the command lines of ``tensatlas`` in a page's blocks of code, without its name."""
    lines = itertools.chain.from_iterable(block.splitlines() for _, block in FENCE.findall(text))
    words = [shlex.split(SHELL_COMMENT.sub("", line)) for line in lines if "tensatlas " in line]
    plain = [list(itertools.dropwhile(ASSIGNMENT.fullmatch, w)) for w in words]
    return [w[1:] for w in plain if w and w[0].rpartition("/")[2] == "tensatlas"]


def mentioned(text: str) -> list[list[str]]:
    """Return the commands of ``tensatlas`` that the running text names, flags included."""
    return [s.split()[1:] for s in spans(text) if re.match(r"tensatlas [a-z]", s)]


@pytest.fixture
def parse(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[[list[str]], str]:
    """Parse a command line and run nothing; return what is wrong with it."""
    monkeypatch.chdir(ROOT)
    for command in COMMANDS:
        monkeypatch.setattr(command, "run", lambda _self, _console: None)

    def wrong(arguments: list[str]) -> str:
        try:
            main(arguments)
        except SystemExit as e:
            return capsys.readouterr().err if e.code else ""
        return ""

    return wrong


@pytest.fixture
def flags_of(capsys: pytest.CaptureFixture[str]) -> Callable[[str], frozenset[str]]:
    """Return the flags of a command by its name; none if there is no such command."""

    @functools.cache
    def flags(command: str) -> frozenset[str]:
        with pytest.raises(SystemExit):
            main([command, "--help"])
        shown = capsys.readouterr().out  # of a command that does not exist, the list of commands
        return frozenset(FLAG.findall(shown)) if f"usage: tensatlas {command} " in shown else frozenset()

    return flags


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere_and_files_exist(page: Path) -> None:
    text = page.read_text()
    assert list(dead_links(page, text)) == []
    assert list(unknown_files(text)) == []


def test_command_lines_can_be_typed(parse: Callable[[list[str]], str]) -> None:
    lines = {tuple(line) for page in PAGES for line in typed(page.read_text())}
    assert len(lines) > 40
    assert {" ".join(line): wrong for line in sorted(lines) if (wrong := parse(list(line)))} == {}


def test_commands_and_flags_in_the_text_exist(flags_of: Callable[[str], frozenset[str]]) -> None:
    found = [line for page in PAGES for line in mentioned(page.read_text())]
    assert len(found) > 30
    used = [(f[0], set(FLAG.findall(" ".join(f)))) for f in found]
    assert [(name, flags) for name, flags in used if not flags_of(name) or flags - flags_of(name)] == []


def test_every_command_has_a_section_that_names_only_its_flags(
    flags_of: Callable[[str], frozenset[str]],
) -> None:
    _, *sections = re.split(r"^## ", (ROOT / "docs" / "commands.md").read_text(), flags=re.MULTILINE)
    by_name = {s.partition("\n")[0]: s for s in sections}
    assert len(by_name) == len(COMMANDS)
    wrong = {name: set(FLAG.findall(" ".join(spans(s)))) - flags_of(name) for name, s in by_name.items()}
    assert {name: flags for name, flags in wrong.items() if flags or not flags_of(name)} == {}


WRONG = """
# A page

[gone](gone.md), [no such heading](#b-page), [here](#a-page), [elsewhere](https://example.org/gone)

`engine/gone.py`, `engine.gone`, `engine.search.archive.Gone`, `engine.search.archive`, `make gone`, `make
test`, `tensatlas vanish RUN`, `tensatlas info RUN --yaml`, `tensatlas info RUN --json`

```sh
X=1 tensatlas info run.tsmr --json   # fine
tensatlas info run.tsmr --yaml
tensatlas export run.tsmr --cell 0,0
.venv/bin/tensatlas vanish
```
"""


def test_a_wrong_page_is_found_out(
    parse: Callable[[list[str]], str], flags_of: Callable[[str], frozenset[str]]
) -> None:
    page = ROOT / "docs" / "wrong.md"
    assert list(dead_links(page, WRONG)) == ["gone.md", "#b-page"]
    gone = ["engine/gone.py", "engine.gone", "engine.search.archive.Gone", "make gone"]
    assert list(unknown_files(WRONG)) == gone
    assert [bool(parse(line)) for line in typed(WRONG)] == [False, True, True, True]
    assert [bool(flags_of(line[0])) for line in mentioned(WRONG)] == [False, True, True]
    assert "--json" in flags_of("info")
    assert "--yaml" not in flags_of("info")

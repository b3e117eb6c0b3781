"""The documentation: its tables and links, and every command that it shows."""

import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest
import trimesh
import typer
from markdown_it import MarkdownIt
from markdown_it.token import Token

import tbcad.app.cli  # noqa: F401 - adds all commands
from tbcad.app.cli import run
from tbcad.core.camera.lists import CAMERA_COLUMNS, LENS_COLUMNS
from tests.app.cli.commands import commands

ROOT = Path(__file__).parents[1]
CHANGELOG = "CHANGELOG.md"  # shows commands as they once were


def documents() -> list[str]:
    """All Markdown files of the checkout; without git, those where documentation is."""
    done = subprocess.run(
        ["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, encoding="utf-8", check=False
    )
    places = ("*.md", "docs/**/*.md", "exports/*.md", "verify/*.md", "benchmarks/*.md")
    found = [str(path.relative_to(ROOT)) for place in places for path in ROOT.glob(place)]
    return sorted(done.stdout.split() or found)


def parsed(document: str) -> list[Token]:
    text = (ROOT / document).read_text(encoding="utf-8")
    return MarkdownIt("commonmark").enable("table").parse(text)


def cells(line: str) -> int:
    """Number of cells of a row; a bar in code or behind a backslash is text."""
    return len(re.sub(r"\\\||`[^`]*`", "", line).strip().strip("|").split("|"))


def test_tables_are_tables() -> None:
    """Every line that begins with a bar is a row of a table, with as many cells as its head."""
    for document in documents():
        tokens = parsed(document)
        lines = (ROOT / document).read_text(encoding="utf-8").splitlines()
        code = {k for one in tokens if one.type == "fence" and one.map for k in range(*one.map)}
        barred = {k for k, line in enumerate(lines) if line.lstrip().startswith("|")}
        tables = [range(*one.map) for one in tokens if one.type == "table_open" and one.map]
        assert barred - code == {k for table in tables for k in table}, document
        for table in tables:
            where = document, lines[table[0]]
            assert len(table) > 2, where
            assert {cells(lines[k]) for k in table} == {cells(lines[table[0]])}, where


def test_links_lead_to_files_and_headings() -> None:
    for document in documents():
        inline = [child for token in parsed(document) for child in token.children or ()]
        targets = [str(one.attrs.get("href") or one.attrs.get("src") or "") for one in inline]
        for target in targets:
            name, _, heading = target.partition("#")
            if not target or re.match(r"[a-z]+:", target):
                continue
            file = (ROOT / document).parent / name if name else ROOT / document
            assert file.exists(), (document, target)
            assert not heading or heading in headings(file), (document, target)


def headings(file: Path) -> set[str]:
    """Names of a page's headings as GitHub links to them."""
    lines = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", line.lower()).replace(" ", "-") for line in lines}


BENCHMARKS = ROOT / "benchmarks"


def test_tables_are_made_from_the_results() -> None:
    code = "import sys; from table import filled; sys.stdout.write(filled(sys.stdin.read()))"
    page = (BENCHMARKS / "README.md").read_text(encoding="utf-8")
    assert {"<!-- table: all -->", "<!-- table: commands -->"} <= set(page.splitlines())
    words = [sys.executable, "-c", code]
    assert subprocess.check_output(words, cwd=BENCHMARKS, input=page, encoding="utf-8") == page


def test_readme_stays_short() -> None:
    """A screen and a half; what does not fit has a page in docs/."""
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 100


def test_packages_of_debian_are_those_of_the_ci() -> None:
    """Those that the kernel needs, and those for pictures; the container has both."""
    ci = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    patterns = (r"libraries=\((.*)\)", r"\n *(.*)\) +# for pictures")
    needed = [sorted(re.findall(pattern, ci)[0].split()) for pattern in patterns]
    for document in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / document).read_text(encoding="utf-8")
        named = [{*one.split()} for one in re.findall(r"`apt-get install ([^`]*)`", text)]
        assert [sorted(one - {"git", "python3-venv"}) for one in named] == needed
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    (named,) = re.findall(r"--no-install-recommends (.*?) &&", text.replace("\\\n", " "))
    assert sorted(named.split()) == sorted(needed[0] + needed[1])
    copied = [name for line in re.findall(r"^COPY (.*)$", text, re.M) for name in line.split()[:-1]]
    allowed = re.findall(r"^!(.*)$", (ROOT / ".dockerignore").read_text(), re.M)
    assert sorted(copied) == sorted(allowed)
    assert all((ROOT / name).exists() for name in copied)


class Command(NamedTuple):
    """A command of a document: where, its words without `tbcad`, and what is said about it."""

    document: str
    words: tuple[str, ...]
    comment: str
    whole: bool


def shown_commands() -> Iterator[Command]:
    for document in documents():
        if document == CHANGELOG:
            continue
        for token in parsed(document):
            if token.type == "fence" and token.info == "sh":
                yield from _of_block(document, token.content.replace("\\\n", " "))
            for child in token.children or ():
                if child.type == "code_inline" and child.content.startswith("tbcad "):
                    words = shlex.split(child.content)[1:]
                    yield Command(document, tuple(words), "", whole=False)


def _of_block(document: str, text: str) -> Iterator[Command]:
    for part in re.split(r"\n|&&", text):
        line, _, comment = part.partition(" #")
        match shlex.split(line):
            case ["tbcad" | ".venv/bin/tbcad", *words]:
                yield Command(document, tuple(words), comment.strip(), whole=True)


EVERY = list(shown_commands())
OF_TBCAD = ("--version", "--install-completion")  # options without a command


def test_commands_are_understood() -> None:
    """By the real command with its real options; a sentence may leave its arguments out."""
    known, whole = commands(), [one.document for one in EVERY if one.whole]
    assert len(whole) > 20
    assert {"README.md", "docs/tolerance.md", "docs/light-field.md"} <= {*whole}
    for shown in EVERY:
        words = shown.words
        name = next(words[:k] for k in range(len(words), -1, -1) if words[:k] in known)
        command: Any = known[name]
        if hasattr(command, "commands"):
            assert not [word for word in words[len(name) :] if word not in OF_TBCAD], shown
            continue
        try:
            command.make_context("tbcad", list(words[len(name) :]))
        except typer.BadParameter as error:
            if shown.whole or error.__cause__ is not None:  # more than an argument is missing
                pytest.fail(f"{shown}: {error}")


SMALL_SENSOR = ["--set", "camera.width_px=416", "--set", "camera.height_px=310"]
FEW_BALLS = ["--set", "prototype.k=2", "--set", "mesh.structure_error_mm=0.2"]
# What makes a command of the documentation quick; what is added later counts.
SMALLER = {
    ("build",): ["--n", "3", "--parts", "shell", *SMALL_SENSOR],
    ("optimize",): ["--set", "n=3", "--candidates", "80", *SMALL_SENSOR],
    ("refocus",): ["--truth-samples", "2", "--frames", "2"],
    ("drawings",): ["--only", "optical_layout"],
    ("reconstruct",): ["--nodes", "32", "--epochs", "1", "--order", "0"],
    ("study", "balance"): ["--views", "1", *SMALL_SENSOR],
    ("study", "ssim"): ["--sensor", "416x310", "--azimuths", "1"],
    ("tolerance",): ["--builds", "20", "--yield", "0.9"],
}
PICTURES = ["--width", "96", "--height", "72"]
# Needs other computers; programs that tests/clients start; a prototype and its photographs, or
# simulated ones, which take minutes: these commands have tests of their own.
# And show goes on until it is stopped: tests/light/viewer.
NOT_RUN = {
    *("--scheduler", "--clients", "--port", "boards/", "captures/real", "simulate-run", "show"),
    *("runs/first", "calibration/", "calibration", "captures/first", "calibration-shell/"),
}
OF_THEIR_OWN = ("docs/tour.md",)  # documents whose commands have a test of their own
SAMPLE = ROOT / "docs" / "sample"


@pytest.fixture(scope="module")
def whole_export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both parts and the mandrels of a small design, with few pixels and balls."""
    out = tmp_path_factory.mktemp("documentation") / "exports"
    words = ["build", "--n", "3", *SMALL_SENSOR, *FEW_BALLS, "--set", "shell.negative=true"]
    words += ["--no-verify", "--out", str(out)]
    assert run(words) == 0
    return out


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer simulated builds, pictures, viewpoints and processes."""
    few = {"SEARCH_BUILDS": 10, "PHOTOGRAPHED_BUILDS": 1, "BUILT_IN": ("diamond",)}
    for name, value in few.items():
        monkeypatch.setattr(f"tbcad.tolerancing.analysis.{name}", value)
    monkeypatch.setattr("tbcad.tolerancing.montecarlo.sharpness.VIEWPOINTS", ((60.0,), 1, 640.0))


def smaller(shown: Command) -> list[str]:
    words = shown.words
    later = [k for k, word in enumerate(words) if word == "--n"][1:]
    words = tuple(word for k, word in enumerate(words) if not {k, k - 1} & {*later})
    more = next((more for name, more in SMALLER.items() if words[: len(name)] == name), [])
    if words[0] == "build" and "--dry-run" not in words and "exit" not in shown.comment:
        more = [*more, "--no-verify"]
    return [*words, *more, *(PICTURES if words[0] in ("view", "refocus") else [])]


def tried(document: str) -> Iterator[Command]:
    """Commands of a document: not those of one before it, if no later one here uses their files."""
    every = [one for one in EVERY if one.whole and one.document not in OF_THEIR_OWN]
    every = [one for one in every if not NOT_RUN & {*one.words}]
    before = {one.words for one in every if one.document < document}
    mine = [one for one in every if one.document == document]
    for k, one in enumerate(mine):
        files = {word for word in one.words if re.search(r"[a-z][/.]", word)} - {"exports/"}
        later = {word for other in mine[k + 1 :] for word in other.words}
        if one.words not in before or files & later:
            yield one


def test_every_command_is_tried_somewhere() -> None:
    """And in its own document where a later one opens what it has written."""
    found = {one.document: [*tried(one.document)] for one in EVERY}
    every = [one for one in EVERY if one.whole and one.document not in OF_THEIR_OWN]
    words = {one.words for some in found.values() for one in some}
    assert words == {one.words for one in every if not NOT_RUN & {*one.words}}
    assert any(one.words[0] == "capture" for one in found["docs/report.md"])


def expected_code(shown: Command) -> int:
    code = re.search(r"exit (\d)", shown.comment)
    return int(code[1]) if code else 0


@pytest.mark.slow
@pytest.mark.usefixtures("quick", "standing")
@pytest.mark.parametrize(
    "document", sorted({one.document for one in EVERY if one.whole} - {*OF_THEIR_OWN})
)
def test_commands_work_one_after_the_other(
    document: str, whole_export: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a user types them, on a small design: with an export and a mesh of the user's own."""
    monkeypatch.chdir(tmp_path)
    for name in ("my.ply", "bunny.ply", "dragon.ply"):
        trimesh.creation.icosphere(2, 20.0).export(tmp_path / name)
    for name, columns in (("my-cameras.csv", CAMERA_COLUMNS), ("my-lenses.csv", LENS_COLUMNS)):
        (tmp_path / name).write_text(",".join(columns) + "\n")
    (tmp_path / "lamps.csv").write_text("x_mm,y_mm,z_mm\n200,0,120\n-90,150,90\n")
    sky = np.full((8, 16, 3), 0.5, dtype=np.float32)
    assert cv2.imwrite(str(tmp_path / "sky.hdr"), sky)
    (tmp_path / "captures").mkdir()
    for shown in tried(document):
        # A build before this one has left shells alone; the sample is quickly verified.
        shutil.rmtree(tmp_path / "exports", ignore_errors=True)
        export = SAMPLE if shown.words[0] == "verify" else whole_export
        shutil.copytree(export, tmp_path / "exports")
        assert run(smaller(shown)) == expected_code(shown), shown.words

"""Broken copies of a real prototype must be caught, each for its reason; edited paper is told."""

from __future__ import annotations

from pathlib import Path

import pytest
from tbcad_verify import main
from tbcad_verify.shell.integrity import is_paper

from tests.verify.corpus.broken_prototypes import GOOD, PROTOTYPES
from tests.verify.corpus.copies import change, copy, load
from tests.verify.corpus.mutation import Mutation, attempt

pytestmark = pytest.mark.corpus


@pytest.mark.parametrize("mutation", [*GOOD, *PROTOTYPES], ids=str)
def test_caught(mutation: Mutation, good_prototype: Path, tmp_path: Path) -> None:
    assert attempt(mutation, good_prototype, tmp_path) == ""


def tied_list(data: bytes) -> bytes:
    return data + b"18,1,TIES,cable ties,,,,,,,,,,,,,bought\n"


def edited_pdf(data: bytes) -> bytes:
    return data.replace(b"(Title)", b"(Name)")


def test_edited_paper_is_told_and_refused_only_strictly(
    good_prototype: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(good_prototype, tmp_path / "export")
    paper = [name for name in load(folder, "manifest.json")["files"] if is_paper(name)]
    assert {"assembly.pdf", "bom.csv", "wiring.csv", "camera.json", "drawing_plate.pdf"} <= {*paper}
    for name in paper:
        change(folder, name, edited_pdf if name.endswith(".pdf") else tied_list)
    assert main([str(folder), "-q"]) == 0
    verdict, line = capsys.readouterr().out.splitlines()
    assert verdict.startswith("Files: PASS")
    assert line.startswith("changed since the build: assembly.pdf, bom.csv, camera.json, ")
    assert main([str(folder), "-q", "--strict"]) == 1
    assert capsys.readouterr().out == "Files: FAIL, failed: paper\n"
    change(folder, "plate_holes.csv", lambda data: data + b"\n")
    assert main([str(folder), "-q"]) in (1, 2)

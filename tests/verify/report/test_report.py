"""The whole verification: what it writes, what it says, and that it fails when it should."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pytest
import tbcad_verify
from rich.console import Console
from tbcad_verify import verify
from tbcad_verify.mesh import rays
from tbcad_verify.mesh.stl import read_facets
from tbcad_verify.record.export import read_export
from tbcad_verify.report.checks import Check
from tbcad_verify.report.report import Report, summary_json
from tbcad_verify.report.text import strictly
from tbcad_verify.shell import measured_shell, pixels
from tbcad_verify.shell.integrity import manifest_checks

from tests.exported_files import contents
from tests.verify.corpus.broken_meshes import MESHES
from tests.verify.corpus.broken_records import RECORDS
from tests.verify.corpus.mutation import Batch, batches
from tests.verify.optical_setups import IN_PROCESS
from tests.verify.synthetic_export import Cells, Design, export, sign

pytestmark = pytest.mark.usefixtures("standing")

MIRROR_KEYS = [
    *("id", "coverage_facet_mm", "coverage_fitted_mm"),
    *("centre_error_mm", "radius_error_mm", "pixels"),
]
NAMES = ["design.json", "mirrors.csv", "shell_a.stl"]


def failed(report: Report) -> set[str]:
    return {check.name for check in report.checks if check.passed is not True}


def detail(report: Report, name: str) -> str:
    return "; ".join(check.detail for check in report.checks if check.name == name)


def test_a_good_export_passes(export_folder: Path) -> None:
    said: list[str] = []
    (export_folder / "notes.txt").write_text("mine", encoding="utf-8")
    report = verify(export_folder, said.append, IN_PROCESS)
    assert (said[0], said[-1]) == ("reading", "every pixel")
    assert failed(report) == set()
    assert report.passed
    assert next(check.measured for check in report.checks if check.name == "other files") == 1
    written = json.loads((export_folder / "verify.json").read_text())
    assert list(written) == ["pass", "target_mm", "checks", "printing", "mirrors"]
    assert written["pass"] is True
    assert written["target_mm"] == 40.0
    for check in written["checks"]:
        held = check["limit"] is not None
        words = [] if held or "detail" not in check else ["detail"]
        assert list(check) == ["name", "file", "pass", "measured", "limit", "unit", *words]
    ids = [mirror["id"] for mirror in written["mirrors"]]
    assert ids == sorted(ids)
    assert len(ids) == 98
    for mirror in written["mirrors"]:
        assert list(mirror) == MIRROR_KEYS
        assert mirror["coverage_fitted_mm"] >= 40
        assert mirror["pixels"] > 0


@pytest.mark.slow
def test_same_export_same_bytes(export_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    verify(export_folder, options=IN_PROCESS)
    before = contents(export_folder)
    monkeypatch.setattr(rays, "THREADS", rays.THREADS + 1)
    verify(export_folder, options=IN_PROCESS)
    assert contents(export_folder) == before


def test_command_line(sample_folder: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-m", "tbcad_verify", str(sample_folder)],
        capture_output=True,
        encoding="utf-8",
        check=False,
        env={"PYTHONPATH": str(Path(tbcad_verify.__file__).parents[1])},
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.startswith("Files: PASS, as designed 89 virtual cameras see 20 mm\n")
    assert run.stderr.splitlines()[-1].endswith(" s] verify: STEP")
    assert "\x1b" not in run.stdout


# One for each check that fails first; marked corpus, all others are tried on real exports.
BROKEN = (
    "inside out",
    "a facet turned",
    "in inches",
    "shifted by 20 um",
    "a facet without area",
    "a mirror dented by 10 um",
    "a loose piece in the wall",
    "a centre 10 nm off the normal",
    "a direction without its mirror",
    "camera b 0.1 mm aside",
    "an odd id",
    "a mirror's polar_deg",
)


MUTATIONS = [one for one in (*MESHES, *RECORDS) if one.name in BROKEN]
# After which no mirror is found, all of a half are elsewhere, or that which others change is gone.
ALONE = {"inside out", "in inches", "camera b 0.1 mm aside", "a direction without its mirror"}


@pytest.mark.parametrize("batch", batches(MUTATIONS, ALONE), ids=str)
def test_broken_export_fails_for_its_reason(
    synthetic_shells: tuple[Path, Cells], tmp_path: Path, batch: Batch
) -> None:
    assert batch.attempt(synthetic_shells[0], tmp_path) == ""


def test_a_mirror_missing_from_mesh_and_record(tmp_path: Path) -> None:
    """Consistent, watertight, and every mirror left sees enough: but one is not there."""
    folder, _ = export(tmp_path / "x", Design(without=(10,)))
    lines = (folder / "mirrors.csv").read_text().splitlines(keepends=True)
    kept = [line for line in lines if line[1:5] != "0010"]
    (folder / "mirrors.csv").write_text("".join(kept))
    assert failed(verify(sign(folder), options=IN_PROCESS)) == {"directions"}


def manifest_of(folder: Path) -> tuple[Check, ...]:
    """Whether the files are those of the manifest, and how many others there are."""
    record = read_export(folder)
    meshes = {part.stl: read_facets(folder, part.stl)[1].digest for part in record.parts}
    return tuple(manifest_checks(record, {**record.digests, **meshes}))


def test_listed_but_missing_and_unlisted_files(export_folder: Path) -> None:
    (export_folder / "notes.csv").write_text("x", encoding="utf-8")
    foreign, _, _ = manifest_of(sign(export_folder))
    assert "notes.csv" in foreign.detail
    (export_folder / "notes.csv").unlink()
    missing, _, _ = manifest_of(export_folder)
    assert not missing.passed
    assert "notes.csv" in missing.detail
    unlisted, _, _ = manifest_of(sign(export_folder, NAMES))
    assert not unlisted.passed
    assert "shell_b.stl" in unlisted.detail


@pytest.mark.parametrize("lost", [False, True])
def test_changed_paper_is_told_and_fails_only_strictly(
    export_folder: Path, shell_report: Report, capsys: pytest.CaptureFixture[str], lost: bool
) -> None:
    (export_folder / "camera.json").write_text("mine", encoding="utf-8")
    if lost:
        (export_folder / "camera.json").unlink()
    checks = manifest_of(export_folder)
    others = (one for one in shell_report.checks if one.name not in {c.name for c in checks})
    report = replace(shell_report, checks=(*checks, *others))
    assert failed(report) == set()
    assert json.loads(summary_json(report))["changed"] == ["camera.json"]
    report.show(Console(width=80))
    assert capsys.readouterr().out.splitlines()[2] == "changed since the build: camera.json"
    strict = replace(report, checks=tuple(strictly(report.checks)))
    assert failed(strict) == {"paper"}
    assert strict.verdict == "Files: FAIL, failed: paper"
    assert detail(strict, "paper") == "changed since the build: camera.json"
    assert all(check.passed for check in strictly(manifest_of(sign(export_folder))))


def test_a_check_that_breaks_is_unknown_and_no_pass(
    export_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = Mock(side_effect=ZeroDivisionError("on purpose"))
    monkeypatch.setattr(pixels.light, "full_sensor", broken)
    report = verify(export_folder, options=IN_PROCESS)
    assert not report.passed
    unknown = {check.name for check in report.checks if check.passed is None}
    assert unknown == set(pixels.CHECKS)
    written = json.loads((export_folder / "verify.json").read_text())
    lost = [check for check in written["checks"] if check["pass"] is None]
    assert all(check["detail"] == "ZeroDivisionError: on purpose" for check in lost)
    assert all(mirror["pixels"] is None for mirror in written["mirrors"])
    assert "unknown: light paths" in report.verdict


def test_everything_optical_is_unknown_without_a_setup(
    export_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(measured_shell, "recover", Mock(side_effect=MemoryError))
    report = verify(export_folder, options=IN_PROCESS)
    names = {check.name for check in report.checks if check.passed is None}
    assert {"mirrors found", "coverage, facets", "light paths"} <= names
    assert "watertight" not in names

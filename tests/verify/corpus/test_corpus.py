"""Broken meshes and records of a real export must be caught; what is as good must not be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tbcad_verify import main, verify

from tests.verify.corpus.broken_files import gone
from tests.verify.corpus.broken_meshes import MESHES
from tests.verify.corpus.broken_records import RECORDS
from tests.verify.corpus.copies import copy, sign
from tests.verify.corpus.harmless import HARMLESS
from tests.verify.corpus.mesh_changes import dented, mesh
from tests.verify.corpus.mutation import Mutation, fails, refused
from tests.verify.corpus.trial import HERE, attempt
from tests.verify.corpus.whole_corpus import ALL

pytestmark = pytest.mark.corpus


@pytest.mark.parametrize("mutation", [*MESHES, *RECORDS], ids=lambda mutation: mutation.name)
def test_caught(mutation: Mutation, good: Path, tmp_path: Path) -> None:
    outcome = attempt(mutation, good, tmp_path, HERE)
    assert not outcome.wanting, outcome


@pytest.mark.parametrize("mutation", HARMLESS, ids=lambda m: m.name)
def test_not_refused_without_need(mutation: Mutation, good: Path, tmp_path: Path) -> None:
    outcome = attempt(mutation, good, tmp_path, HERE)
    assert not outcome.wanting, outcome


def test_names_tell_mutations_apart() -> None:
    names = [mutation.name for mutation in ALL]
    assert len(set(names)) == len(names) > 45


@pytest.mark.parametrize(
    ("mutation", "wanting"),
    [
        (fails("nothing", "none", lambda _: (), "centre error"), "another exit status"),
        (fails("wrong reason", "STL", mesh(dented), "watertight"), "none of watertight says so"),
        (fails("wrong words", "STL", mesh(dented), "surface error", "b9999"), "does not say"),
        (fails("no export", "folder", gone("design.json"), "poses"), "refused instead"),
        (refused("other words", "folder", gone("design.json"), "mirrors.csv"), "does not say"),
    ],
    ids=lambda value: value.name if isinstance(value, Mutation) else "",
)
def test_a_trial_can_fail(mutation: Mutation, wanting: str, good: Path, tmp_path: Path) -> None:
    assert wanting in attempt(mutation, good, tmp_path, HERE).wanting


def test_what_takes_too_long_is_unknown(good: Path) -> None:
    report = verify(good, options=replace(HERE, seconds=0.05))
    lost = [check for check in report.checks if check.passed is None]
    assert {check.name.partition(" ")[0] for check in lost} == {"step"}
    assert {check.file for check in lost} == {"shell_a.step", "shell_b.step"}
    assert not report.passed
    assert report.verdict.startswith("FAIL: unknown: step solid")


def test_exit_status_not_proved(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(good, tmp_path / "export")
    mesh(dented)(folder)
    sign(folder)
    assert main([str(folder), "-q"]) == 1
    assert capsys.readouterr().out.startswith("FAIL: failed: centre error")


def test_exit_status_refused(
    good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(good, tmp_path / "export")
    (folder / "shell_b.step").unlink()
    assert main([str(folder), "-q"]) == 2
    out = capsys.readouterr()
    assert out.out == ""
    assert "shell_b.step: missing" in out.err

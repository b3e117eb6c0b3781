"""Negatives that are not the shell's, or not what the record says, are refused."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tbcad_verify import BadExport
from tbcad_verify.mesh.stl import read_facets
from tbcad_verify.record.export import read_export
from tbcad_verify.record.poses import contradictions
from tbcad_verify.report.checks import Check
from tbcad_verify.run.processes import Processes
from tbcad_verify.run.stages import stage_titles
from tbcad_verify.run.verify import verify
from tbcad_verify.shell.mandrel import mandrel_results
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.step.shell_checks import compare_all, front_step_checks
from tbcad_verify.step.step_file import read_step_files

from tbcad.cad.formats.mesh_files import write_stl
from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.output.build import write_export
from tbcad.output.parts import SHELL
from tbcad.shell.halves import camera_a_mandrel_mesh, camera_a_mesh
from tests.exported_files import edit_json
from tests.verify.optical_setups import IN_PROCESS, optical_setup_of

SETTINGS = ["n=4", "shell.negative=true", "width_px=200", "height_px=150"]
STL, STEP = "mandrel_a.stl", "mandrel_a.step"
# Meshes and good STEP files of both edges are read in other tests; these take long for each.
pytestmark = pytest.mark.usefixtures("standing")
ON_VALLEYS = pytest.mark.parametrize(
    "edges", ["valley", pytest.param("pedestal", marks=pytest.mark.slow)], indirect=True
)


def made(*options: str) -> MirrorDesign:
    return design(load_spec(None, [*SETTINGS, *options]))


@pytest.fixture(scope="module", params=["valley", "pedestal"])
def edges(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def mirrors(edges: str) -> MirrorDesign:
    return made(f"shell.edges={edges}")


@pytest.fixture(scope="module")
def good(mirrors: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("good")
    write_export(mirrors, folder, [SHELL])
    return folder


@pytest.fixture(scope="module")
def setup(good: Path) -> OpticalSetup:
    return optical_setup_of(good)


@pytest.fixture
def folder(good: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(good, tmp_path / "copy"))


def mesh_checks(
    folder: Path, setup: OpticalSetup, cutter_mm: float | None = None
) -> dict[str, Check]:
    record = read_export(folder)
    mandrel = record.mandrels[0]
    facets, _ = read_facets(folder, mandrel.stl)
    results = mandrel_results(record, mandrel, facets, lambda: setup, cutter_mm)
    return {check.name: check for check in results.checks}


def failing(folder: Path, setup: OpticalSetup) -> dict[str, str]:
    checks = mesh_checks(folder, setup)
    return {name: check.detail for name, check in checks.items() if check.passed is not True}


def step_failing(folder: Path) -> dict[str, str]:
    """What fails of the first negative's STEP, but for what needs its mesh."""
    record = read_export(folder)
    record = replace(record, parts=(), mandrels=record.mandrels[:1])  # no other file is read
    with Processes(1, 120) as processes:
        files = read_step_files(record, processes)
    checks = front_step_checks(record, record.mandrels, {}, compare_all(record, files))
    return {check.name: check.detail for check in checks if check.passed is False}


@ON_VALLEYS
def test_a_whole_export_passes(folder: Path, edges: str) -> None:
    cutter = 2.0 if edges == "valley" else None  # none reaches beside the fins for grooves
    report = verify(folder, options=replace(IN_PROCESS, cutter_mm=cutter))
    about = [check for check in report.checks if check.file.startswith("mandrel")]
    assert not [check for check in report.checks if check.passed is not True]
    assert sum(check.name == "mandrel mirrors" for check in about) == 2
    widths = [check.measured for check in report.checks if check.name == "fillet width"]
    assert len(widths) == (2 if cutter else 0)
    assert all(width is not None and 300 < width < 900 for width in widths)  # 2 mm tan 13 degrees
    assert sum(check.name == "step walls" for check in about) == 2 * (edges == "pedestal")
    assert "mandrels" in stage_titles(read_export(folder))


def test_draft_is_told(good: Path, setup: OpticalSetup, edges: str) -> None:
    draft = mesh_checks(good, setup)["mandrel draft"]
    assert draft.measured == pytest.approx({"valley": 18.6, "pedestal": -29.9}[edges], abs=0.1)
    assert {"valley": "draw the shell", "pedestal": "dissolve"}[edges] in draft.detail


def moved(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices + np.array([0, 0.01, 0]), mesh.triangles)


def mirrored_in_y(mesh: Mesh) -> Mesh:
    """The design is symmetrical about y = 0, its mirrors' facets are not."""
    return Mesh(mesh.vertices * [1, -1, 1], mesh.triangles[:, ::-1])


def with_a_dent(mesh: Mesh) -> Mesh:
    """One corner inside a mirror, 20 um deep."""
    vertices = mesh.vertices.copy()
    vertices[mesh.triangles[1000, 0]] *= 1 - 2e-4
    return Mesh(vertices, mesh.triangles)


def with_a_long_foot(mesh: Mesh) -> Mesh:
    """The foot is no plane any more: one of its corners hangs down."""
    vertices = mesh.vertices.copy()
    bottom = np.flatnonzero(vertices[:, 2] == vertices[:, 2].min())
    vertices[bottom[len(bottom) // 2], 2] -= 0.05
    return Mesh(vertices, mesh.triangles)


def test_a_broken_mesh_is_refused(folder: Path, setup: OpticalSetup, mirrors: MirrorDesign) -> None:
    good = camera_a_mandrel_mesh(mirrors)
    write_stl(folder / STL, good)
    assert failing(folder, setup) == {}
    for change in (moved, mirrored_in_y, with_a_dent, with_a_long_foot):
        write_stl(folder / STL, change(good))
        found = "mandrel body" if change is with_a_long_foot else "mandrel mirrors"
        assert found in failing(folder, setup), change


@pytest.mark.parametrize("share", [None, 0.1, 0.97, 1.03])
def test_balls_up_to_the_smallest_pocket_reach_all(
    good: Path, setup: OpticalSetup, mirrors: MirrorDesign, edges: str, share: float | None
) -> None:
    """But none reaches beside the fins that cut the grooves of pedestals."""
    pocket = float(1 / mirrors.arrays[0].mirrors.curvature.max())
    cutter = None if share is None else share * pocket
    check = mesh_checks(good, setup, cutter)["mandrel reach"]
    assert check.limit == cutter
    assert check.passed is (share is None or (share < 1 and edges == "valley"))
    if edges == "valley" or share is None:
        assert check.measured == pytest.approx(pocket, rel=1e-4)


def test_a_spike_is_in_the_way(folder: Path, setup: OpticalSetup, mirrors: MirrorDesign) -> None:
    good = camera_a_mandrel_mesh(mirrors)
    vertices = good.vertices.copy()
    vertices[good.triangles[1000, 0]] *= 1.05
    write_stl(folder / STL, Mesh(vertices, good.triangles))
    check = mesh_checks(folder, setup, 2.0)["mandrel reach"]
    assert check.passed is False
    assert check.measured is not None
    assert 0 < check.measured < 2


def test_the_shell_is_no_negative(folder: Path, setup: OpticalSetup, mirrors: MirrorDesign) -> None:
    write_stl(folder / STL, camera_a_mesh(mirrors))
    assert {"mandrel mirrors", "mandrel surface", "mandrel reach"} <= {*failing(folder, setup)}


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (["shell.seam_flange.bolts=5"], "seam: 5 holes of 4.3 mm, not 6"),
        (["shell.foot_flange.dowel_hole_mm=3.9"], "foot: 2 holes of another size"),
        (["shell.wall_mm=2"], "mm from a mirror, not 3"),
    ],
    ids=["number", "size", "wall"],
)
def test_other_holes_are_refused(
    folder: Path, setup: OpticalSetup, edges: str, options: list[str], fault: str
) -> None:
    other = made(f"shell.edges={edges}", *options)
    write_stl(folder / STL, camera_a_mandrel_mesh(other))
    failed = failing(folder, setup)
    assert {*failed} == {"mandrel body"}
    assert fault in failed["mandrel body"]


def test_another_draft_is_refused(folder: Path, setup: OpticalSetup) -> None:
    edit_json(folder / "design.json", lambda one: one["mandrels"][0].update(draft_deg=25.0))
    assert {*failing(folder, setup)} == {"mandrel draft, deviation from record"}


def test_a_pull_is_a_unit_vector(folder: Path) -> None:
    edit_json(folder / "design.json", lambda one: one["mandrels"][0].update(pull=[0.0, 0.0, 2.0]))
    with pytest.raises(BadExport, match="no unit vector"):
        read_export(folder)


@pytest.mark.parametrize(
    "change",
    [
        lambda one: one["mandrels"].pop(),
        lambda one: one["spec"]["shell"].update(negative=False),
        lambda one: one["mandrels"][1].update(camera="a"),
    ],
    ids=["one", "not asked for", "twice"],
)
def test_mandrels_are_those_of_the_spec(
    folder: Path, change: Callable[[dict[str, Any]], None]
) -> None:
    assert contradictions(read_export(folder)) == []
    edit_json(folder / "design.json", change)
    assert contradictions(read_export(folder)) == ["the mandrels of shell.negative"]


class TestStep:
    """Broken STEP files, read as text and by the kernel."""

    def test_good_ones_pass(self, good: Path) -> None:
        assert step_failing(good) == {}

    @ON_VALLEYS
    def test_the_shells_is_refused(self, folder: Path) -> None:
        text = (folder / "shell_a.step").read_text(encoding="utf-8")
        (folder / STEP).write_text(text.replace("shell_a", "mandrel_a"), encoding="utf-8")
        assert {"step outward", "step mandrel planes", "step mandrel volume"} <= {
            *step_failing(folder)
        }

    @ON_VALLEYS
    def test_a_face_that_is_not_turned_is_named(self, folder: Path) -> None:
        """Kernels repair it: only the text tells."""
        text = (folder / STEP).read_text(encoding="utf-8")
        changed, number = re.subn(
            r"(ADVANCED_FACE\('a0007',.*?),\.F\.\)", r"\1,.T.)", text, count=1, flags=re.DOTALL
        )
        assert number == 1
        (folder / STEP).write_text(changed, encoding="utf-8")
        assert "a0007" in step_failing(folder)["step outward"]

    def test_other_holes_are_refused(self, folder: Path, edges: str, tmp_path: Path) -> None:
        other = tmp_path / "other"
        other.mkdir()
        options = ["shell.foot_flange.bolts=4", "shell.seam_flange.bolt_hole_mm=4.4"]
        write_export(made(f"shell.edges={edges}", *options), other, [SHELL])
        shutil.copy(other / STEP, folder / STEP)
        assert {*step_failing(folder)} == {"step mandrel holes"}

"""What a build would give, against what it gives."""

from pathlib import Path

import pytest
import trimesh

import tbcad
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.output.overview import Overview, overview
from tbcad.output.parts import SHELL
from tbcad.prototype.arrangement import arrangements
from tbcad.prototype.model import build_prototype_model
from tbcad.shell.halves import camera_a_mesh


@pytest.fixture(scope="module")
def small(small_design: MirrorDesign) -> Overview:
    return overview(small_design)


def test_counts_of_mirrors(small: Overview, small_design: MirrorDesign) -> None:
    first, second = small_design.arrays
    assert small.mirrors == len(first) + len(second)
    directions = {tuple(row) for array in small_design.arrays for row in array.u.round(9).tolist()}
    assert small.virtual_cameras == len(directions)


def test_shell_volume(small: Overview, small_design: MirrorDesign) -> None:
    """The coarse mesh is inside of the mirrors' spheres by up to its tolerance."""
    assert small.shell_prints is not None
    mesh = camera_a_mesh(small_design)
    exact = 2 * trimesh.Trimesh(mesh.vertices, mesh.triangles).volume / 1000
    assert small.shell_prints.volume_cm3 == pytest.approx(exact, rel=0.1)


@pytest.mark.slow
def test_prototype(small_design: MirrorDesign) -> None:
    few = MirrorDesign(load_spec(None, ["n=6", "prototype.k=2"]), small_design.arrays)
    found, model = overview(few), build_prototype_model(arrangements(few))
    assert found.spec == model.spec
    assert found.prototype is not None
    assert found.prototype.balls + found.prototype.caps == len(model.layout)
    printed = [part for part in model.printed if part.role != "tool"]
    exact = sum(part.solid.volume for part in printed) / 1000
    assert found.prototype.prints.volume_cm3 == pytest.approx(exact, rel=0.15)
    assert found.prototype.turning_mass_g == pytest.approx(model.balance.mass_g, rel=0.1)


def test_a_prototype_that_cannot_be_made_is_left_out(tmp_path: Path) -> None:
    """Camera b is no half turn of camera a: nothing can stand in for both halves."""
    leaning = tbcad.load_spec(None, ["n=2", "camera_mm=[100, 5, -100]"])
    built = tbcad.build(leaning, tmp_path / "exports", verify=False)
    assert built.parts == ("shell",)
    assert built.note.startswith("no prototype: a prototype needs cameras that a half turn")
    names = {path.name for path in (tmp_path / "exports").iterdir()}
    assert {"shell_a.step", "design.json", "manifest.json"} <= names
    assert "prototype.json" not in names


def test_a_mandrel_without_room_is_refused_before_a_build() -> None:
    settings = ["n=3", "shell.negative=true", "shell.wall_mm=50"]
    with pytest.raises(InputError, match=r"mandrel has no room .* shell\.wall_mm smaller"):
        overview(design(load_spec(None, settings)), [SHELL])

"""What a build would give, against what it gives."""

import pytest
import trimesh

from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.output.overview import Overview, overview
from tbcad.prototype.model import build_prototype_model
from tbcad.shell.files import camera_a_mesh
from tbcad.spec.load import load_spec


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
def test_prototype(small: Overview, small_design: MirrorDesign) -> None:
    model = build_prototype_model(small_design)
    assert small.spec == model.spec
    assert small.prototype is not None
    assert small.prototype.balls + small.prototype.caps == len(model.layout)
    printed = [part for part in model.printed if part.role != "tool"]
    exact = sum(part.solid.volume for part in printed) / 1000
    assert small.prototype.prints.volume_cm3 == pytest.approx(exact, rel=0.15)
    assert small.prototype.turning_mass_g == pytest.approx(model.balance.mass_g, rel=0.1)


class TestWithoutPrototype:
    def test_says_why(self) -> None:
        found = overview(
            design(load_spec(None, ["n=3", "camera_mm=[100, 5, -100]"])), optional_prototype=True
        )
        assert found.prototype is None
        assert found.note.startswith("no prototype: a prototype needs cameras that a half turn")

    def test_is_refused_when_it_is_asked_for(self) -> None:
        with pytest.raises(InputError, match="a prototype needs cameras"):
            overview(design(load_spec(None, ["n=3", "camera_mm=[100, 5, -100]"])), ["prototype"])

    def test_of_shells_alone(self, small_design: MirrorDesign) -> None:
        assert overview(small_design, ["shell"]).prototype is None

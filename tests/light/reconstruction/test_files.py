"""Files of a field's mesh and volume, read back."""

import json
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLImageDataReader

from tbcad.app.api import reconstruct
from tbcad.errors import InputError
from tbcad.light.reconstruction import files
from tbcad.light.reconstruction.field import Field, Grid, read_field, write_field
from tbcad.light.reconstruction.files import MESH_SUFFIXES, mesh_distance, mesh_file
from tbcad.light.reconstruction.fitted import levels, reconstruction, used_rays
from tbcad.light.reconstruction.rays import captured_rays
from tbcad.light.reconstruction.start import part_file
from tbcad.light.reconstruction.surface import field_mesh
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS, LightField
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object
from tbcad.options.captures import ReconstructOptions
from tests.ball_captures import RADIUS_MM, quick_choice, without_trials  # noqa: F401
from tests.light.reconstruction.balls import (
    BELOW,
    COLOUR,
    NODES,
    RADIUS,
    WIDTH_MM,
    ball,
    made_of,
    parallel_rays,
)

MIDDLE, BALL_RADIUS = (1.0, 2.0, 3.0), 4.0
RAYS = parallel_rays(lambda away: away < 7, across=41)
SMALL: dict[str, Any] = {"nodes": 24, "epochs": 3, "order": "0"}
ASKED = ReconstructOptions("", **SMALL)


@pytest.fixture(scope="module")
def mesh() -> trimesh.Trimesh:
    made = made_of(lambda at: BELOW + 8 * (BALL_RADIUS - np.linalg.norm(at - MIDDLE, axis=1)))
    return field_mesh(made, 1.0)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_the_file_is_closed_and_always_the_same(mesh: trimesh.Trimesh, suffix: str) -> None:
    content = mesh_file(mesh, suffix)
    assert content == mesh_file(mesh, suffix)
    read = trimesh.load(BytesIO(content), file_type=suffix[1:], force="mesh")
    assert read.is_watertight
    assert read.volume > 0
    middle, unit = (MIDDLE, 1.0) if suffix != ".glb" else ((1.0, 3.0, -2.0), 1000.0)
    assert unit * read.bounds.mean(axis=0) == pytest.approx(middle, abs=0.05)
    assert unit * read.extents == pytest.approx([2 * BALL_RADIUS] * 3, abs=0.1)


@pytest.mark.parametrize("suffix", [".glb", ".ply"])
def test_colours_are_those_of_the_field(mesh: trimesh.Trimesh, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"ball{suffix}"
    path.write_bytes(mesh_file(mesh, suffix))
    unit = "m" if suffix == ".glb" else "mm"
    read = load_object(path, 60.0, ObjectOptions(unit=unit))
    assert read.albedo.reshape(-1, 3).mean(axis=0) == pytest.approx(COLOUR, abs=0.01)


def some_of_it() -> Field:
    """A ball's upper half."""
    whole = ball()
    wanted = whole.grid.dense((whole.grid.points[:, 2] > 0).astype(np.float32)) > 0
    grid = Grid.about(wanted, WIDTH_MM)
    kept = whole.grid.row[tuple(grid.place.T)]
    return Field(grid, whole.values[kept])


def test_the_volume_has_density_and_colour_in_place() -> None:
    made = some_of_it()
    content = files.volume_file(made)
    assert content == files.volume_file(made)
    reader = vtkXMLImageDataReader()
    reader.ReadFromInputStringOn()
    reader.SetInputString(content.decode())
    reader.Update()
    image = reader.GetOutput()
    for point, inside in (((0, 0, 5.0), True), ((0, 0, 8.0), False), ((0, 0, -5.0), False)):
        number = image.FindPoint(point)
        density = image.GetPointData().GetArray("density").GetTuple1(number)
        assert (density > 1) == inside
    x = image.FindPoint((6.0, 0.0, 1.0))
    assert np.allclose(image.GetPoint(x), (6.0, 0.0, 1.0))
    colour = vtk_to_numpy(image.GetPointData().GetArray("colour"))[x]
    assert np.allclose(colour, COLOUR)


def test_numpy_has_the_same_from_the_fields_file(tmp_path: Path) -> None:
    made = some_of_it()
    write_field(tmp_path / "field.npz", made)
    told = [line for line in (files.__doc__ or "").splitlines() if line.startswith("    ")]
    lines = "\n".join(line.strip() for line in told)
    names = {"np": np}
    exec(lines.replace("field.npz", str(tmp_path / "field.npz")), names)
    density, colour = (np.asarray(names[name]) for name in ("density", "colour"))
    assert density.shape == (NODES,) * 3
    at = tuple(made.grid.place.T)
    assert np.allclose(density[at], made.density(), atol=1e-4)
    assert np.allclose(colour[at], COLOUR)
    assert density.sum() == density[at].sum()
    assert density[NODES // 2, NODES // 2, int((5 / WIDTH_MM + 0.5) * (NODES - 1))] > RADIUS


def sphere(radius: float) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=5, radius=radius)


def test_of_two_spheres_it_is_the_difference_of_their_radii() -> None:
    found = mesh_distance(sphere(6.5), patterned_ball(7.0), RAYS)
    for value in (found.mean_mm, found.percentile_95_mm, found.hausdorff_mm,
                  found.whole_mean_mm, found.whole_hausdorff_mm):  # fmt: skip
        assert value == pytest.approx(0.5, abs=0.01)


def test_what_no_ray_meets_counts_for_the_whole_alone() -> None:
    """A ball that ends at z = -4, though the true one goes on, seen from above."""
    flat = sphere(7.0)
    points = np.array(flat.vertices)
    points[:, 2] = np.maximum(points[:, 2], -4.0)
    steep = RAYS.direction[:, 2] < -0.9
    above = replace(RAYS, entry=RAYS.entry[steep], direction=RAYS.direction[steep])
    found = mesh_distance(
        trimesh.Trimesh(points, flat.faces, process=False), patterned_ball(7.0), above
    )
    assert found.hausdorff_mm < 0.1
    assert found.whole_hausdorff_mm == pytest.approx(3.0, abs=0.05)
    assert found.whole_mean_mm > found.mean_mm


@pytest.fixture(scope="module")
def made(ball: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("made") / "field.npz"
    with pytest.MonkeyPatch.context() as patch:
        without_trials(patch)
        reconstruct(ball, out=out, **SMALL)
    return out


def stopped_after(epochs: int) -> Callable[[str], None]:
    """What ends a reconstruction as Ctrl-C does, when so many epochs are done."""
    left = [epochs]

    def detail(text: str) -> None:
        left[0] -= text.startswith("epoch")
        if left[0] == 0:
            raise KeyboardInterrupt

    return detail


def test_a_ball_is_where_it_is(made: Path) -> None:
    field = read_field(made)
    radius = np.linalg.norm(field.grid.points, axis=1)
    dense = field.density() > 0.5 * field.density().max()
    assert radius[dense].max() < RADIUS_MM + 2 * field.grid.pitch_mm
    facts = field.facts
    assert facts["psnr_left_out_db"] > 20
    assert facts["mirrors_left_out"] == 2
    assert facts["unexplained_light"] < 0.01


@pytest.mark.parametrize("epochs", [1, 6])
def test_same_bytes_after_a_stop(epochs: int, ball: Path, made: Path, tmp_path: Path) -> None:
    out = tmp_path / "field.npz"
    with pytest.raises(KeyboardInterrupt):
        reconstruct(ball, out=out, **SMALL, detail=stopped_after(epochs))
    assert [file.name for file in tmp_path.iterdir()] == [".field.npz.part"]
    with pytest.raises(InputError, match="go on with resume=True, or begin anew with force=True"):
        reconstruct(ball, out=out, **SMALL)
    told: list[str] = []
    reconstruct(ball, out=out, **SMALL, resume=True, detail=told.append)
    assert out.read_bytes() == made.read_bytes()
    assert [file.name for file in tmp_path.iterdir()] == ["field.npz"]
    assert len(told) == sum(level.epochs for level in levels(ASKED)) - epochs


def test_same_bytes_after_a_stop_where_pixels_have_an_area(ball: Path, tmp_path: Path) -> None:
    """The grids before the last have single rays: also where the stop is between them."""
    options: dict[str, Any] = {"nodes": 16, "epochs": 2, "order": "1", "rays": 4, "blur_px": 0.4}
    whole, out = tmp_path / "whole.npz", tmp_path / "field.npz"
    reconstruct(ball, out=whole, **options)
    assert read_field(whole).facts["rays_a_pixel"] == 4
    with pytest.raises(KeyboardInterrupt):
        reconstruct(ball, out=out, **options, detail=stopped_after(3))
    reconstruct(ball, out=out, **options, resume=True)
    assert out.read_bytes() == whole.read_bytes()


def test_a_checkpoint_of_other_options_is_refused(ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "field.npz"
    with pytest.raises(KeyboardInterrupt):
        reconstruct(ball, out=out, **SMALL, detail=stopped_after(1))
    kept = part_file(out).read_bytes()
    for other, message in (
        ({"seed": 1}, "is of seed 0, not 1"),
        ({"nodes": 30}, "is of nodes 24, not 30"),
        ({"frame": 1}, "is of another capture"),
    ):
        with pytest.raises(InputError, match=message):
            reconstruct(ball, out=out, resume=True, **{**SMALL, **other})
    assert part_file(out).read_bytes() == kept
    part_file(out).write_bytes(kept[:-2000])
    with pytest.raises(InputError, match=r"is damaged .*: begin anew with force=True"):
        reconstruct(ball, out=out, **SMALL, resume=True)


def test_frames_start_from_the_one_before(ball: Path, tmp_path: Path) -> None:
    stages: list[str] = []
    out = tmp_path / "turn.npz"
    reconstruct(ball, out=out, **SMALL, frame="all", progress=stages.append)
    first, second = (read_field(tmp_path / f"turn-{k}.npz").facts for k in (0, 1))
    assert first["started_from"] is None
    assert second["started_from"] == first["light_field"] != second["light_field"]
    assert "frame 0: grid of 10 nodes" in stages
    assert "frame 1: grid of 10 nodes" not in stages
    assert second["psnr_left_out_db"] > first["psnr_left_out_db"] - 1
    whole = (tmp_path / "turn-1.npz").read_bytes()
    (tmp_path / "turn-1.npz").unlink()
    reconstruct(ball, out=out, **SMALL, frame="all", resume=True)
    assert (tmp_path / "turn-1.npz").read_bytes() == whole


def test_mirrors_left_out_are_whole_and_few(ball: Path) -> None:
    rays = captured_rays(LightField.read(ball))
    used = used_rays(rays, 0)
    assert not set(rays.mirror[used]) & set(rays.mirror[~used])
    assert 1 <= len(set(rays.mirror[~used])) <= 4
    assert not np.array_equal(used, used_rays(rays, 1))


def test_facts_tell_how_it_was_made(made: Path) -> None:
    facts = read_field(made).facts
    assert facts["trials"] == [{"order": 0, "smooth_density": 5e-5, "loss": 0.5}]
    assert [level["nodes"] for level in facts["chosen"]["levels"]] == [10, 17, 24]
    assert json.dumps(facts)


@pytest.mark.parametrize(
    ("plane", "message"),
    [("colour", "show nothing brighter than"), ("mirror", "no ray .* meets its capture sphere")],
)
def test_what_shows_nothing_is_refused(plane: str, message: str, ball: Path) -> None:
    source = LightField.read(ball)
    for frame in source.frames.values():
        frame.planes[plane][:] = 0
    with pytest.raises(InputError, match=message):
        reconstruction(source, ASKED)


def test_light_that_no_hull_explains(ball: Path) -> None:
    """A bright mirror that no other confirms is outside of the hull."""
    source = LightField.read(ball)
    frame = source.frames["a"]
    alone = frame.planes["mirror"] == 20
    frame.planes["colour"][alone] = 200
    facts = reconstruction(source, ReconstructOptions("", nodes=48, epochs=1)).facts
    assert 0.0003 < facts["unexplained_light"] < 0.1


def test_mirrors_that_are_known_badly_count_less(ball: Path) -> None:
    """Also where each pixel is its central ray, as it is by default."""
    source = LightField.read(ball)
    told = {
        name: [0.0 if k % 2 else 5.0 for k in range(len(frame.u))]
        for name, frame in source.frames.items()
    }
    known = replace(source, facts={**source.facts, RAY_SIGMAS: told})
    even, weighted = (reconstruction(one, ASKED) for one in (source, known))
    assert not np.array_equal(even.values, weighted.values)

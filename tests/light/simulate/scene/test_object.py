"""Objects from files of all kinds, good and bad, and the built-in one."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.simulate.capture.files import read_object, write_object
from tbcad.light.simulate.scene.object import SceneObject, built_in_object, pattern
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object
from tbcad.light.simulate.scene.ray_casting import (
    LAMP_LIGHT,
    LAMPS,
    SKY_LIGHT,
    RayHits,
    cast_rays,
    prepared_scene,
)

CAPTURE_MM = 60.0


def box(size: float = 20.0) -> trimesh.Trimesh:
    return trimesh.creation.box((size, size, size))


def from_above(subject: SceneObject, x: float, y: float) -> RayHits:
    """What a ray sees that falls on the object along -z."""
    scene = prepared_scene(subject)
    return cast_rays(scene, np.array([[x, y, 100.0]]), np.array([[0.0, 0.0, -1.0]]))


def light_on_top(normal: np.ndarray) -> float:
    return float(np.maximum(LAMPS @ normal, 0) @ LAMP_LIGHT) + SKY_LIGHT


@pytest.mark.parametrize("kind", ["ply", "stl", "obj", "glb", "off"])
def test_file_formats(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"box.{kind}"
    box().export(path)
    subject = load_object(path, CAPTURE_MM, ObjectOptions(unit="mm"))
    assert subject.patterned
    assert subject.radius == pytest.approx(10 * np.sqrt(3))
    assert from_above(subject, 1, 2).depth == pytest.approx([90])


def test_vertex_colours_are_shown(tmp_path: Path) -> None:
    mesh = box()
    mesh.visual.vertex_colors = np.tile([200, 100, 50, 255], (8, 1)).astype(np.uint8)
    mesh.export(tmp_path / "box.ply")
    subject = load_object(tmp_path / "box.ply", CAPTURE_MM)
    colour = from_above(subject, 0.5, 0.25).colour[0]
    assert colour / colour[0] == pytest.approx([1, 0.5, 0.25], abs=1e-3)


def test_flat_top_is_lit_by_lamberts_law(tmp_path: Path) -> None:
    """Facets of their own, so that the normal is the facet's: albedo times cosines."""
    mesh = trimesh.Trimesh(
        [[-10, -10, 5], [10, -10, 5], [10, 10, 5], [-10, 10, 5]], [[0, 1, 2], [0, 2, 3]]
    )
    mesh.visual.vertex_colors = np.tile([255, 0, 0, 255], (4, 1)).astype(np.uint8)
    mesh.export(tmp_path / "square.ply")
    seen = from_above(load_object(tmp_path / "square.ply", CAPTURE_MM), 3, 4)
    up = np.array([0.0, 0.0, 1.0])
    assert seen.colour[0] == pytest.approx([255 * min(light_on_top(up), 1), 0, 0], abs=0.1)


def test_texture_is_shown(tmp_path: Path) -> None:
    """At the middle of a texel it is that texel."""
    picture = np.random.default_rng(4).integers(40, 250, (8, 16, 3), dtype=np.uint8)
    mesh = trimesh.Trimesh(
        [[-10, -10, 0], [10, -10, 0], [10, 10, 0], [-10, 10, 0]], [[0, 1, 2], [0, 2, 3]]
    )
    corners = [[0, 0], [1, 0], [1, 1], [0, 1]]
    mesh.visual = trimesh.visual.TextureVisuals(uv=corners, image=Image.fromarray(picture))
    mesh.export(tmp_path / "square.glb")
    subject = load_object(tmp_path / "square.glb", CAPTURE_MM, ObjectOptions(up="z", unit="mm"))
    assert subject.texture is not None
    for column, row in ((3, 1), (12, 6)):
        x, y = (column + 0.5) / 16 * 20 - 10, 10 - (row + 0.5) / 8 * 20
        colour, texel = from_above(subject, x, y).colour[0], subject.texture[row, column] / 255
        assert colour / colour.max() == pytest.approx(texel / texel.max(), abs=0.01)


def test_texture_outside_of_its_folder_is_not_read(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4), (255, 0, 0)).save(tmp_path / "secret.png")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "a.mtl").write_text("newmtl m\nmap_Kd ../secret.png\n")
    (inside / "a.obj").write_text(
        "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 9 0 0\nv 0 9 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
    )
    with pytest.warns(PlausibilityWarning, match=r"secret\.png is not in the folder"):
        assert load_object(inside / "a.obj", CAPTURE_MM).texture is None


def test_paint_pattern(tmp_path: Path) -> None:
    mesh = box()
    mesh.visual.vertex_colors = np.full((8, 4), 255, dtype=np.uint8)
    mesh.export(tmp_path / "box.ply")
    assert not load_object(tmp_path / "box.ply", CAPTURE_MM).patterned
    subject = load_object(tmp_path / "box.ply", CAPTURE_MM, ObjectOptions(paint="pattern"))
    assert subject.patterned
    colour = from_above(subject, 1, 2).colour[0] / 255
    shown = pattern(np.array([[1.0, 2.0, 10.0 - 1e-9]]))[0]
    assert colour / colour.max() == pytest.approx(shown / shown.max(), abs=0.01)


def test_paint_plain(tmp_path: Path) -> None:
    box().export(tmp_path / "box.stl")
    subject = load_object(tmp_path / "box.stl", CAPTURE_MM, ObjectOptions(paint="plain"))
    colours = from_above(subject, 1, 2).colour[0]
    assert not subject.patterned
    assert np.ptp(colours) == 0 < colours[0]


def test_too_large_names_the_size(tmp_path: Path) -> None:
    box(50).export(tmp_path / "box.stl")
    with pytest.raises(InputError, match=r"50 x 50 x 50 mm and reaches 43\.3 mm .* 30"):
        load_object(tmp_path / "box.stl", CAPTURE_MM)
    fitted = load_object(tmp_path / "box.stl", CAPTURE_MM, ObjectOptions(fit=True))
    assert fitted.radius == pytest.approx(30)


def test_off_centre_does_not_fit_but_can_be_fitted(tmp_path: Path) -> None:
    mesh = box(10)
    mesh.apply_translation([40, 0, 0])
    mesh.export(tmp_path / "box.stl")
    with pytest.raises(InputError, match="does not fit the capture sphere"):
        load_object(tmp_path / "box.stl", CAPTURE_MM)
    fitted = load_object(tmp_path / "box.stl", CAPTURE_MM, ObjectOptions(fit=True))
    assert fitted.points.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-3)


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file; give a triangle mesh"):
        load_object(tmp_path / "absent.ply", CAPTURE_MM)
    with pytest.raises(InputError, match="no such file; give a triangle mesh"):
        load_object(tmp_path, CAPTURE_MM)


def test_built_in_object_is_a_closed_body_of_many_colours() -> None:
    subject = built_in_object(CAPTURE_MM)
    mesh = trimesh.Trimesh(subject.points, subject.faces)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert subject.radius == pytest.approx(0.98 * 30)
    facets = np.cross(*(subject.points[subject.faces[:, k]] - subject.points[subject.faces[:, 0]]
                        for k in (1, 2)))  # fmt: skip
    assert (np.einsum("fx,fx->f", facets, subject.normals[subject.faces[:, 0]]) > 0).all()
    assert len(np.unique(np.round(subject.albedo[:, 0], 2), axis=0)) > 50


def test_object_file_round_trip(tmp_path: Path) -> None:
    subject = built_in_object(CAPTURE_MM)
    write_object(tmp_path / "object.npz", subject)
    first = (tmp_path / "object.npz").read_bytes()
    back = read_object(tmp_path)
    assert back.name == subject.name
    assert np.array_equal(back.points, subject.points)
    assert np.array_equal(back.albedo, subject.albedo)
    write_object(tmp_path / "object.npz", back)
    assert (tmp_path / "object.npz").read_bytes() == first


@pytest.mark.parametrize("change", ["cut", "faces", "shape", "pickle"])
def test_damaged_objects(tmp_path: Path, change: str) -> None:
    subject = built_in_object(CAPTURE_MM)
    path = tmp_path / "object.npz"
    write_object(path, subject)
    with np.load(path) as read:
        arrays = dict(read)
    if change == "cut":
        path.write_bytes(path.read_bytes()[:1000])
    elif change == "faces":
        np.savez(path, **{**arrays, "faces": arrays["faces"] + len(subject.points)})
    elif change == "shape":
        np.savez(path, **{**arrays, "normals": arrays["normals"][:-1]})
    else:
        np.savez(path, **{**arrays, "points": np.array([{}], dtype=object)})
    with pytest.raises(InputError, match="damaged"):
        read_object(tmp_path)

"""Unit, axis, colours and shading of objects from files, however their facets are turned."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.core.geometry.vectors import norm, unit
from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.simulate.capture.files import read_object, write_object
from tbcad.light.simulate.scene.lamps import PointLights, RectangularLamps, lit_by
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object
from tbcad.light.simulate.scene.ray_casting import (
    Scene,
    built_in_shade,
    cast_rays,
    prepared_scene,
    surface_hits,
)
from tbcad.types import Floats

CAPTURE_MM, BALL_MM = 60.0, 20.0


def ball() -> trimesh.Trimesh:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=BALL_MM)
    mesh.visual.vertex_colors = np.full((len(mesh.vertices), 4), 255, dtype=np.uint8)
    return mesh


def inverted() -> trimesh.Trimesh:
    mesh = ball()
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False, visual=mesh.visual)


def double_sided() -> trimesh.Trimesh:
    """Each facet twice, with the same corners: normals at the corners cancel."""
    mesh = ball()
    both = np.concatenate([mesh.faces, mesh.faces[:, ::-1]])
    return trimesh.Trimesh(mesh.vertices, both, process=False, visual=mesh.visual)


def mixed() -> trimesh.Trimesh:
    """Facets turned at random."""
    mesh = ball()
    turned = np.random.default_rng(2).random(len(mesh.faces)) < 0.4
    faces = np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)
    return trimesh.Trimesh(mesh.vertices, faces, process=False, visual=mesh.visual)


def with_normals(normals: Floats) -> bytes:
    """A ball as a PLY file with these normals in it."""
    mesh = ball()
    text = mesh.export(file_type="ply", encoding="ascii").decode()
    head, body = text.split("end_header\n")
    lines = body.split("\n")
    for k, normal in enumerate(normals):
        lines[k] += " " + " ".join(map(repr, normal.tolist()))
    names = "".join(f"property float n{axis}\n" for axis in "xyz")
    place = head.index("element face")
    return (head[:place] + names + head[place:] + "end_header\n" + "\n".join(lines)).encode()


OUTWARD = unit(np.asarray(ball().vertices, dtype=np.float64))
SIDES = np.where(np.arange(len(OUTWARD)) % 2, 1, -1)
FILES = {
    "outward": ball().export(file_type="ply"),
    "inverted": inverted().export(file_type="ply"),
    "double sided": double_sided().export(file_type="ply"),
    "turned at random": mixed().export(file_type="ply"),
    "normals inward": with_normals(-OUTWARD),
    "normals at random sides": with_normals(OUTWARD * SIDES[:, None]),
}


def seen_ball(scene: Scene) -> tuple[Floats, Floats]:
    """Colours (n,) on a ball that rays meet from outside, and its exact normals there (n, 3)."""
    normal = unit(np.random.default_rng(3).normal(size=(500, 3)))
    start = 2 * BALL_MM * normal + np.random.default_rng(5).normal(size=(500, 3))
    direction = unit(-normal)
    along = (start * direction).sum(axis=1)
    depth = -along - np.sqrt(along**2 - (start**2).sum(axis=1) + BALL_MM**2)
    colour = cast_rays(scene, start, direction).colour[:, 0].astype(np.float64)
    return colour, unit(start + depth[:, None] * direction)


@pytest.mark.parametrize("kind", FILES)
def test_a_ball_is_lit_on_the_side_that_rays_meet(tmp_path: Path, kind: str) -> None:
    """Against the light on a sphere in closed form: under the sky, and of lamps."""
    (tmp_path / "a.ply").write_bytes(FILES[kind])
    subject = load_object(tmp_path / "a.ply", CAPTURE_MM)
    assert trimesh.Trimesh(subject.points, subject.faces, process=False).volume > 0
    assert ((subject.normals * subject.points).sum(axis=1) > 0).all()
    scene = prepared_scene(subject)
    colour, normal = seen_ball(scene)
    assert colour == pytest.approx(255 * built_in_shade(normal), abs=4)
    lamp = np.array([0.0, 0, 1e5])
    lit = Scene(subject, scene.embree, scene.shade, scene.radius,
                lamps=PointLights(lamp[None], np.ones((1, 3))))  # fmt: skip
    colour, normal = seen_ball(lit)
    away = np.abs(normal[:, 2]) > 0.15  # facets at the edge of the shadow are in it or not
    assert colour[away] == pytest.approx(255 * np.maximum(normal[away, 2], 0), abs=4)


@pytest.mark.parametrize("kind", FILES)
def test_a_ball_under_the_prototypes_lamps(tmp_path: Path, kind: str) -> None:
    (tmp_path / "a.ply").write_bytes(FILES[kind])
    lamps = RectangularLamps(np.array([[200.0, 0, 0]]), np.array([[-1.0, 0, 0]]), 10, 10, 100)
    scene = prepared_scene(lit_by(lamps, load_object(tmp_path / "a.ply", CAPTURE_MM)))
    colour, normal = seen_ball(scene)
    assert (colour[normal[:, 0] < -0.1] == 0).all()
    assert (colour[normal[:, 0] > 0.9] > 215).all()


def test_a_card_has_two_sides(tmp_path: Path) -> None:
    corners = [[-10, -10, 0], [10, -10, 0], [10, 10, 0], [-10, 10, 0]]
    mesh = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    mesh.visual.face_colors = np.full((2, 4), 255, dtype=np.uint8)
    mesh.export(tmp_path / "a.ply")
    subject = load_object(tmp_path / "a.ply", CAPTURE_MM, ObjectOptions(fit=True))
    assert subject.radius == pytest.approx(30)
    scene = prepared_scene(subject)
    for side in (1, -1):
        start, direction = np.array([[3.0, 4, 50 * side]]), np.array([[0.0, 0, -side]])
        wanted = built_in_shade(np.array([[0.0, 0, side]]))
        assert cast_rays(scene, start, direction).colour[0] / 255 == pytest.approx(wanted[0])
        hits = surface_hits(scene, start, direction)
        assert hits.normals(subject)[0] == pytest.approx([0, 0, side])


@pytest.mark.parametrize(
    ("points", "wrong"),
    [
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], "no area"),
        ([[1, 1, 1]] * 3, "no extent"),
        ([[0, 0, float("nan")], [1, 0, 0], [0, 1, 0]], "not finite"),
        ([[0, 0, 0], [1e12, 0, 0], [0, 1, 0]], "coordinates up to 1e"),
    ],
)
def test_nothing_to_see(tmp_path: Path, points: list[list[float]], wrong: str) -> None:
    trimesh.Trimesh(points, [[0, 1, 2]], process=False).export(tmp_path / "a.ply")
    for fit in (False, True):
        with pytest.raises(InputError, match=wrong):
            load_object(tmp_path / "a.ply", CAPTURE_MM, ObjectOptions(fit=fit))


@pytest.mark.parametrize(
    ("name", "options", "wanted"),
    [
        ("a.ply", ObjectOptions(), [1, 2, 3]),
        ("a.ply", ObjectOptions(up="y"), [1, -3, 2]),
        ("a.ply", ObjectOptions(unit="in"), [25.4, 50.8, 76.2]),
        ("a.ply", ObjectOptions(unit="cm", up="y"), [10, -30, 20]),
        ("a.glb", ObjectOptions(unit="mm"), [1, -3, 2]),
        ("a.glb", ObjectOptions(unit="cm", up="z"), [10, 20, 30]),
    ],
)
@pytest.mark.filterwarnings("ignore::tbcad.errors.PlausibilityWarning")
def test_unit_and_axis(
    tmp_path: Path, name: str, options: ObjectOptions, wanted: list[float]
) -> None:
    corner = np.array([1.0, 2, 3])
    box = trimesh.creation.box(corner)
    box.apply_translation(corner / 2)  # from the origin to a corner
    box.export(tmp_path / name)
    told: list[str] = []
    subject = load_object(tmp_path / name, 200.0, options, told.append)
    assert subject.points[norm(subject.points).argmax()] == pytest.approx(wanted)
    assert subject.reading is not None
    assert told == [f"{name}: unit {subject.reading.unit}, {subject.reading.up} up, "
                    "colours: the built-in pattern, for the file has none"]  # fmt: skip


def test_too_large_names_the_unit_that_fits(tmp_path: Path) -> None:
    trimesh.creation.box((10, 20, 30)).export(tmp_path / "a.glb")
    with pytest.raises(InputError, match="give --unit mm, or use --fit"):
        load_object(tmp_path / "a.glb", CAPTURE_MM)


def test_too_small_names_the_unit_that_fits(tmp_path: Path) -> None:
    trimesh.creation.box((0.01, 0.02, 0.03)).export(tmp_path / "a.stl")
    with pytest.warns(PlausibilityWarning, match="give --unit m, scale it"):
        load_object(tmp_path / "a.stl", CAPTURE_MM)


def test_several_pictures_and_colours(tmp_path: Path) -> None:
    """Two pictures of other sizes, which repeat, and a plain colour: also read back."""
    Image.new("RGB", (4, 2), (255, 0, 0)).save(tmp_path / "red.png")
    Image.new("RGB", (2, 8), (0, 255, 0)).save(tmp_path / "green.png")
    (tmp_path / "a.mtl").write_text(
        "newmtl r\nmap_Kd red.png\nnewmtl g\nmap_Kd green.png\nnewmtl b\nKd 0 0 1\n"
    )
    strips = "".join(f"v {x} {y} 0\n" for x in (-15, -5, 5, 15) for y in (-5, 5))
    faces = "".join(
        f"usemtl {name}\nf {2 * k + 1}/1 {2 * k + 3}/2 {2 * k + 4}/3 {2 * k + 2}/4\n"
        for k, name in enumerate("rgb")
    )
    (tmp_path / "a.obj").write_text(
        f"mtllib a.mtl\n{strips}vt -3 -3\nvt 3 -3\nvt 3 3\nvt -3 3\n{faces}"
    )
    subject = load_object(tmp_path / "a.obj", CAPTURE_MM)
    write_object(tmp_path / "object.npz", subject)
    for one in (subject, read_object(tmp_path)):
        assert colours_of_strips(one) == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


def colours_of_strips(subject: SceneObject) -> list[list[float]]:
    start = np.array([[x, 1.0, 50.0] for x in (-10.0, 0.0, 10.0)])
    hits = surface_hits(prepared_scene(subject), start, np.tile([0.0, 0, -1], (3, 1)))
    return [[float(value) for value in row] for row in hits.albedo(subject).round(6)]


def test_facets_without_colours_beside_others_are_noted(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl r\nKd 1 0 0\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 9 0 0\nv 0 9 0\nv 9 9 0\nf 1 2 3\nusemtl r\nf 2 4 3\n"
    )
    with pytest.warns(PlausibilityWarning, match="1 of its 2 facets have no colour"):
        load_object(tmp_path / "a.obj", CAPTURE_MM)


def test_objects_of_older_captures_are_read(tmp_path: Path) -> None:
    """Their one texture was not multiplied, and light was of one side."""
    arrays = {
        "name": "old", "points": np.eye(3), "faces": [[0, 1, 2]], "normals": np.eye(3),
        "albedo": np.full((1, 3, 3), 0.8), "uv": np.zeros((1, 3, 2)),
        "texture": np.full((2, 4, 3), 51, dtype=np.uint8), "patterned": False,
        "light": np.array([0.5, 0.6, 0.7]),
    }  # fmt: skip
    np.savez(tmp_path / "object.npz", **arrays)
    subject = read_object(tmp_path)
    assert subject.light is not None
    assert subject.light.tolist() == [[0.5, 0.5], [0.6, 0.6], [0.7, 0.7]]
    inward = -unit(np.ones((1, 3)))
    hits = surface_hits(prepared_scene(subject), -5 * inward, inward)
    assert hits.albedo(subject)[0] == pytest.approx([0.2] * 3)


def test_options_out_of_their_range() -> None:
    for wrong in ({"unit": "furlong"}, {"up": "x"}, {"paint": "blue"}):
        with pytest.raises(InputError, match="is not known: allowed is"):
            ObjectOptions(**wrong)  # type: ignore[arg-type]

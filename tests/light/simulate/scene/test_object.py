"""Objects from files of all kinds, good and bad, lit and painted; and the built-in one."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.lamp_light import RectangularLamps
from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.simulate.capture.files import read_object, write_object
from tbcad.light.simulate.scene.lamps import PointLights, lit_by
from tbcad.light.simulate.scene.object import SceneObject, built_in_object, pattern
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object
from tbcad.light.simulate.scene.ray_casting import (
    LAMP_LIGHT,
    LAMPS,
    SKY_LIGHT,
    RayHits,
    Scene,
    built_in_shade,
    cast_rays,
    prepared_scene,
    surface_hits,
)
from tbcad.types import Floats, Ints

CAPTURE_MM, BALL_MM = 60.0, 20.0


def box(size: float = 20.0) -> trimesh.Trimesh:
    return trimesh.creation.box((size, size, size))


def from_above(subject: SceneObject, x: float, y: float) -> RayHits:
    """What a ray sees that falls on the object along -z."""
    scene = prepared_scene(subject)
    return cast_rays(scene, np.array([[x, y, 100.0]]), np.array([[0.0, 0.0, -1.0]]))


def test_paint(tmp_path: Path) -> None:
    mesh = box()
    mesh.visual.vertex_colors = np.full((8, 4), 255, dtype=np.uint8)
    mesh.export(tmp_path / "box.ply")
    own, patterned, plain = (
        load_object(tmp_path / "box.ply", CAPTURE_MM, ObjectOptions(paint=paint))
        for paint in ("own", "pattern", "plain")
    )
    assert (own.patterned, patterned.patterned, plain.patterned) == (False, True, False)
    colour = from_above(patterned, 1, 2).colour[0] / 255
    shown = pattern(np.array([[1.0, 2.0, 10.0 - 1e-9]]))[0]
    assert colour / colour.max() == pytest.approx(shown / shown.max(), abs=0.01)
    grey, white = (from_above(one, 1, 2).colour[0] for one in (plain, own))
    assert np.ptp(grey) == 0 < grey[0] < white[0]


@pytest.mark.parametrize(
    ("size", "shift", "wrong"),
    [(50, 0, r"50 x 50 x 50 mm and reaches 43\.3 mm .* 30"), (10, 40, "does not fit the capture")],
)
def test_what_does_not_fit_names_the_size_and_can_be_fitted(
    tmp_path: Path, size: float, shift: float, wrong: str
) -> None:
    mesh = box(size)
    mesh.apply_translation([shift, 0, 0])
    mesh.export(tmp_path / "box.stl")
    with pytest.raises(InputError, match=wrong):
        load_object(tmp_path / "box.stl", CAPTURE_MM)
    fitted = load_object(tmp_path / "box.stl", CAPTURE_MM, ObjectOptions(fit=True))
    assert fitted.radius == pytest.approx(30)
    assert fitted.points.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-3)


def test_built_in_object_is_a_closed_body_of_many_colours() -> None:
    subject = built_in_object(CAPTURE_MM)
    mesh = trimesh.Trimesh(subject.points, subject.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert subject.radius == pytest.approx(0.98 * 30)
    assert (dot(mesh.face_normals, subject.normals[mesh.faces[:, 0]]) > 0).all()
    assert len(np.unique(np.round(subject.albedo[:, 0], 2), axis=0)) > 50


def test_object_file_round_trip(tmp_path: Path) -> None:
    lamps = RectangularLamps(np.array([[200.0, 0, 0]]), np.array([[-1.0, 0, 0]]), 10, 10, 100)
    subject = lit_by(lamps, built_in_object(CAPTURE_MM))
    assert prepared_scene(subject).shade.max() == 1.0
    write_object(tmp_path / "object.npz", subject)
    first = (tmp_path / "object.npz").read_bytes()
    back = read_object(tmp_path)
    for name, value in vars(subject).items():
        assert np.array_equal(getattr(back, name), value), name
    write_object(tmp_path / "object.npz", back)
    assert (tmp_path / "object.npz").read_bytes() == first


def test_damaged_objects(tmp_path: Path) -> None:
    path = tmp_path / "object.npz"
    write_object(path, built_in_object(CAPTURE_MM))
    cut = path.read_bytes()[:1000]
    with np.load(path) as read:
        arrays = dict(read)
    strange = {
        "faces": arrays["faces"] + len(arrays["points"]),
        "normals": arrays["normals"][:-1],
        "light": arrays["points"][:, 0],
        "uv": np.zeros((len(arrays["faces"]), 3, 2)),
        "points": np.array([{}], dtype=object),
    }
    for name in (*strange, "cut"):
        np.savez(path, **{**arrays, name: strange.get(name, 0)})
        if name == "cut":
            path.write_bytes(cut)
        with pytest.raises(InputError, match="damaged"):
            read_object(tmp_path)


BALL = trimesh.creation.icosphere(subdivisions=4, radius=BALL_MM)
BALL.visual.vertex_colors = np.full((len(BALL.vertices), 4), 255, dtype=np.uint8)


def ball_of(faces: Ints) -> bytes:
    mesh = trimesh.Trimesh(BALL.vertices, faces, process=False, visual=BALL.visual)
    return bytes(mesh.export(file_type="ply"))


def with_normals(normals: Floats) -> bytes:
    """A ball as a PLY file with these normals in it."""
    text = BALL.export(file_type="ply", encoding="ascii").decode()
    head, body = text.split("end_header\n")
    lines = body.split("\n")
    for k, normal in enumerate(normals):
        lines[k] += " " + " ".join(map(repr, normal.tolist()))
    names = "".join(f"property float n{axis}\n" for axis in "xyz")
    place = head.index("element face")
    return (head[:place] + names + head[place:] + "end_header\n" + "\n".join(lines)).encode()


OUTWARD = unit(np.asarray(BALL.vertices, dtype=np.float64))
SIDES = np.where(np.arange(len(OUTWARD)) % 2, 1, -1)
INSIDE_OUT = BALL.faces[:, ::-1]
AT_RANDOM = np.random.default_rng(2).random((len(BALL.faces), 1)) < 0.4
FILES = {
    "outward": ball_of(BALL.faces),
    "inverted": ball_of(INSIDE_OUT),
    "double sided": ball_of(np.concatenate([BALL.faces, INSIDE_OUT])),  # normals cancel
    "turned at random": ball_of(np.where(AT_RANDOM, INSIDE_OUT, BALL.faces)),
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
    """Against the light on a sphere in closed form: under the sky, of a point, of a lamp."""
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
    lamps = RectangularLamps(np.array([[200.0, 0, 0]]), np.array([[-1.0, 0, 0]]), 10, 10, 100)
    colour, normal = seen_ball(prepared_scene(lit_by(lamps, subject)))
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
    lamps = LAMPS[:, 2] @ LAMP_LIGHT  # all above: Lambert's law; half of the sky comes from below
    for side, light in ((1, lamps + SKY_LIGHT), (-1, SKY_LIGHT / 2)):
        start, direction = np.array([[3.0, 4, 50 * side]]), np.array([[0.0, 0, -side]])
        assert cast_rays(scene, start, direction).colour[0] / 255 == pytest.approx(light)
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


def test_too_large_or_small_names_the_unit_that_fits(tmp_path: Path) -> None:
    trimesh.creation.box((10, 20, 30)).export(tmp_path / "a.glb")
    with pytest.raises(InputError, match="give --unit mm, or use --fit"):
        load_object(tmp_path / "a.glb", CAPTURE_MM)
    trimesh.creation.box((0.01, 0.02, 0.03)).export(tmp_path / "a.stl")
    with pytest.warns(PlausibilityWarning, match="give --unit m, scale it"):
        load_object(tmp_path / "a.stl", CAPTURE_MM)


def test_several_pictures_and_colours(tmp_path: Path) -> None:
    """A picture whose texels are seen at their middles, one that repeats, and a plain colour."""
    picture = np.random.default_rng(4).integers(0, 256, (8, 16, 3), dtype=np.uint8)
    Image.fromarray(picture).save(tmp_path / "many.png")
    Image.new("RGB", (2, 8), (0, 255, 0)).save(tmp_path / "green.png")
    (tmp_path / "a.mtl").write_text(
        "newmtl m\nmap_Kd many.png\nnewmtl g\nmap_Kd green.png\nnewmtl b\nKd 0 0 1\n"
    )
    strips = "".join(f"v {x} {y} 0\n" for x in (-15, -5, 5, 15) for y in (-5, 5))
    faces = "".join(
        f"usemtl {name}\nf {2 * k + 1}/{j} {2 * k + 3}/{j + 1} {2 * k + 4}/{j + 2} "
        f"{2 * k + 2}/{j + 3}\n"
        for name, k, j in (("m", 0, 1), ("g", 1, 5), ("b", 2, 5))
    )
    places = "".join(
        f"vt {x} {y}\n"
        for low, high in ((0, 1), (-3, 3))
        for x, y in ((low, low), (high, low), (high, high), (low, high))
    )
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{strips}{places}{faces}")
    subject = load_object(tmp_path / "a.obj", CAPTURE_MM)
    write_object(tmp_path / "object.npz", subject)
    texels = [(3, 1), (12, 6)]  # columns and rows
    at = [((x + 0.5) / 16 * 10 - 15, 5 - (y + 0.5) / 8 * 10) for x, y in texels]
    start = np.array([[x, y, 50.0] for x, y in (*at, (0.0, 1.0), (10.0, 1.0))])
    wanted = np.vstack([[picture[y, x] / 255 for x, y in texels], np.eye(3)[1:]])
    for one in (subject, read_object(tmp_path)):
        hits = surface_hits(prepared_scene(one), start, np.tile([0.0, 0, -1], (4, 1)))
        assert hits.albedo(one) == pytest.approx(wanted, abs=1e-6)


def test_facets_without_colours_beside_others_are_noted(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl r\nKd 1 0 0\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 9 0 0\nv 0 9 0\nv 9 9 0\nf 1 2 3\nusemtl r\nf 2 4 3\n"
    )
    with pytest.warns(PlausibilityWarning, match="1 of its 2 facets have no colour"):
        load_object(tmp_path / "a.obj", CAPTURE_MM)

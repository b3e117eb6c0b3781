"""Light adds up: of lamps and of projectors, against captures, closed forms and bundles of rays."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image

import tbcad
from tbcad.app.cli import run
from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.datasets.virtual_cameras import MirrorId
from tbcad.light.reflectance.environment import read_environment
from tbcad.light.reflectance.lamp_places import (
    LEAST_CURVATURE,
    MirrorPixels,
    lamps_of_mirrors,
    projectors,
    reflected,
)
from tbcad.light.reflectance.transport import (
    TRUE_LIGHTS,
    lit_scene,
    open_reflectance,
    relit,
    seen_spots,
)
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import photograph, to_bytes
from tbcad.light.simulate.scene.lamps import PointLights, Spots, received_light
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import Scene, depth_along_rays, prepared_scene
from tbcad.light.simulate.scene.rays import camera_around_object, exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import pinhole_picture
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.simulate.views.viewpoints import image_quality
from tbcad.types import Floats
from tests.app.cli.commands import Command

UP = np.array([0.0, 0.0, 1.0])
PINHOLE = np.array([100.0, 0.0, -100.0])
CENTRE, RADIUS = np.array([85.0, 20.0, 70.0]), 25.0
POINTS = np.array([[0.0, 0, 0], [12.0, -20.0, 9.0], [-25.0, 8.0, -4.0], [3.0, 28.0, 6.0]])
SMALL = ["--width", "96", "--height", "72"]


def plate_scene(z: float, half: float) -> Scene:
    """A square across z."""
    points = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    grey = np.full((2, 3, 3), 0.5)
    return prepared_scene(SceneObject("plate", points, faces, np.tile(UP, (4, 1)), grey))


def spots_at(*places: tuple[float, float, float]) -> Spots:
    up = np.tile(UP, (len(places), 1))
    return Spots(np.array(places), up, up)


def test_light_is_after_lambert_and_the_square_of_the_distance() -> None:
    lamp = np.array([0.0, 30.0, 40.0])
    found = received_light(plate_scene(0, 50).embree, spots_at((0, 0, 0), (0, 30, 0)), lamp)
    assert found == pytest.approx([0.8, (50 / 40) ** 2])


def test_shadows_and_backs_are_dark() -> None:
    scene = plate_scene(5.0, 4.0)
    lamp = np.array([0.0, 0.0, 100.0])
    found = received_light(scene.embree, spots_at((0, 0, 0), (3.7, 0, 0), (4.4, 0, 0)), lamp)
    assert (found > 0).tolist() == [False, False, True]
    assert received_light(scene.embree, spots_at((9, 0, 0)), -lamp) == pytest.approx([0.0])


def test_the_sum_of_the_lamps_is_one_capture_with_all(
    captured: Path, scene: Scene, field: LightField, cameras: tuple[Reflector, Reflector]
) -> None:
    colour = np.array([[0.3, 0.1, 0.2], [0.1, 0.4, 0.0], [0.2, 0.2, 0.5]])
    with open_reflectance(captured) as reflectance:
        lights = PointLights(reflectance.lamps.place, colour)
        for camera in cameras:
            name = camera.camera_id
            bands = photograph(camera.camera, exact_tracer(camera), replace(scene, lamps=lights))
            whole = np.concatenate([band.colour for band in bands]).reshape(-1, 3)
            summed = np.zeros_like(whole, dtype=np.float32)
            summed[reflectance.pixel[name]] = 255 * reflectance.lit(name, colour)
            rays = field.frames[name].planes["mirror"].ravel() > 0
            apart = np.abs(whole.astype(float) - summed)[rays].max(axis=1)
            assert whole[rays].max() > 100
            # Rounded to whole numbers; float32 rays at an edge or a shadow's edge fall beside it.
            assert np.mean(apart > 0.6) < 2e-3


def test_rays_that_meet_nothing_are_left_out(
    captured: Path, scene: Scene, field: LightField
) -> None:
    with open_reflectance(captured) as reflectance:
        for name, frame in field.frames.items():
            pixel = reflectance.pixel[name]
            assert (np.diff(pixel) > 0).all()
            black = frame.planes["colour"].reshape(-1, 3)[pixel].max(axis=1) == 0
            assert not black.any()
            seen = seen_spots(frame, scene)
            assert np.array_equal(seen.pixel, pixel)
            origin, direction = (
                frame.planes[key].reshape(-1, 3)[pixel].astype(float)
                for key in ("origin", "direction")
            )
            off = np.cross(seen.spots.place - origin, direction)
            assert np.linalg.norm(off, axis=1).max() < 1e-3


def traced(direction: Floats, to: Floats, along: Floats) -> Floats:
    """Where a ray from the pinhole off the sphere meets the plane through a point across a way."""
    ray = unit(direction)
    offset = PINHOLE - CENTRE
    half = ray @ offset
    point = PINHOLE + (-half - np.sqrt(half**2 - offset @ offset + RADIUS**2)) * ray
    normal = (point - CENTRE) / RADIUS
    away = ray - 2 * (ray @ normal) * normal
    return np.asarray(point + ((to - point) @ along) / (away @ along) * away)


def test_rays_to_where_a_sphere_reflects_come_to_the_points_and_spread_as_said() -> None:
    """The area of a bundle of exact rays, by differences."""
    found, spread = reflected(CENTRE, RADIUS, PINHOLE, POINTS)
    assert np.linalg.norm(found - CENTRE, axis=1) == pytest.approx(np.full(4, RADIUS))
    for point, at, area in zip(found, POINTS, spread, strict=True):
        way, ray = unit(at - point), unit(point - PINHOLE)
        assert traced(ray, at, way) == pytest.approx(at, abs=1e-8)
        sides = unit(np.cross(ray, [0.3, 0.5, 0.8]))
        step = 1e-5
        first, second = (
            (traced(ray + step * side, at, way) - traced(ray - step * side, at, way)) / (2 * step)
            for side in (sides, np.cross(ray, sides))
        )
        assert np.linalg.norm(np.cross(first, second)) == pytest.approx(area, rel=1e-6)


def flat_mirror(owner: int) -> MirrorPixels:
    """The plane z = 60 over the origin; all pixels belong to one mirror."""
    radius = 1 / LEAST_CURVATURE
    centre = np.array([0.0, 0, 60.0 + radius])
    pinhole = np.array([80.0, 0, 0])
    camera = Camera(pinhole, unit(np.array([-40.0, 0, 60])), np.array([0.0, 1, 0]), 40, 40, 1.5)
    _, spread = reflected(centre, radius, pinhole, np.zeros((1, 3)))
    owners = np.full((40, 40), owner, dtype=np.uint16)
    return MirrorPixels(camera, 1, owners, centre, radius, float(spread[0]))


def test_a_flat_mirror_gives_the_light_of_a_lamp_at_the_pinholes_image() -> None:
    scene = plate_scene(-3.0, 5.0)
    normals = unit(np.array([[0.0, 0, 1], [0.2, 0.3, 1], [0.5, -0.2, 1]]))
    spots = Spots(np.array([[0.0, 0, 0], [10.0, 5, 3], [-9.0, 2, -1]]), normals, normals)
    image = np.array([80.0, 0, 120.0])
    expected = received_light(scene.embree, spots, image)
    found = flat_mirror(1).light(scene.embree, spots)
    assert expected.min() > 0
    assert found == pytest.approx(expected, rel=1e-4)
    assert flat_mirror(2).light(scene.embree, spots).tolist() == [0, 0, 0]
    under = spots_at((0, 0, -5))
    assert flat_mirror(1).light(scene.embree, under) == pytest.approx([0])  # in shadow
    assert flat_mirror(1).light(plate_scene(-9.0, 8.0).embree, under)[0] > 0


def test_what_a_mirror_sees_is_what_it_lights(field: LightField, scene: Scene) -> None:
    """Light goes back along captured rays: their spots get light from their own mirror."""
    frame = field.frames["a"]
    seen = seen_spots(frame, scene)
    numbers = frame.planes["mirror"].ravel()[seen.pixel]
    number = int(np.bincount(numbers).argmax())
    own = numbers == number
    (found,) = projectors(field, (MirrorId("a", number - 1),))
    spots = Spots(*(values[own] for values in vars(seen.spots).values()))
    light = found[0].light(scene.embree, spots)
    steep = np.einsum("kj,kj->k", spots.normal, unit(found[0].centre - spots.place)) > 0.2
    assert steep.sum() > 20
    assert (light[steep] > 0).mean() > 0.97  # but for shadows at edges, by rounding


def test_the_command_writes_projectors_and_relights(
    record: Path, hdr: Path, tmp_path: Path, cli: Command
) -> None:
    out = tmp_path / "thrown"
    cli("capture", record, "--lights", "projectors", "--every", "40", "--out", out)
    with open_reflectance(out) as reflectance:
        assert reflectance.facts["light"] == "projectors"
        brightest = np.asarray(reflectance.transport["a"][:]).max(axis=(1, 2))
        assert (brightest > 0.05).all()
        assert brightest.max() < 10
    size = ("--width", "64", "--height", "48")
    text = cli("view", out, "--light", hdr, *size, "--out", tmp_path / "lit.png").out
    assert "SSIM" in text
    assert "same lamps" not in text


@pytest.fixture(scope="module")
def mirrors(record: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With lamps in the places of virtual cameras."""
    out = tmp_path_factory.mktemp("captures") / "many"
    words = ["capture", str(record), "--lights", "mirrors", "--every", "2", "--out", str(out)]
    assert run(words) == 0
    return out


def test_lamps_are_where_the_virtual_cameras_are(mirrors: Path) -> None:
    with LightField.open(mirrors) as source:
        every = lamps_of_mirrors(source, 1)
        place_of = {
            f"{name}{k + 1:04d}": place
            for name, frame in source.frames.items()
            for k, place in enumerate(zip(frame.u, frame.mirrors.apex, strict=True))
        }
    with open_reflectance(mirrors) as reflectance:
        half = reflectance.lamps
    assert len(half.name) == -(-len(every.name) // 2)
    assert len({tuple(np.round(place_of[one][0], 6)) for one in every.name}) == len(every.name)
    for name, place in zip(half.name, half.place, strict=True):
        u, apex = place_of[name]
        assert np.linalg.norm(place) > np.linalg.norm(apex)  # behind the mirror
        assert np.linalg.norm(np.cross(u, place)) < 0.15 * np.linalg.norm(place)


def test_views_are_like_ray_traced_ones(mirrors: Path, hdr: Path, scene: Scene) -> None:
    """In the light itself, in that of the same lamps, and less so in the light of the capture."""
    light = read_environment(hdr)
    view = camera_around_object(0.5, 0.6, 640.0, 60.0, (160, 120))
    with LightField.open(mirrors) as source, open_reflectance(mirrors) as reflectance:
        found = relit(source, reflectance, light)
        depth = depth_along_rays(scene)
        image = synthesise(MirrorTiles(found.field), view, depth).image
        before = synthesise(MirrorTiles(source), view, depth).image
    lights = light.far_lights(TRUE_LIGHTS), found.lamps
    truths = [
        to_bytes(pinhole_picture(lit_scene(scene, one, found.exposure), view, 2)) for one in lights
    ]
    built_in = image_quality(to_bytes(pinhole_picture(scene, view)), before)
    itself, same = (image_quality(truth, image) for truth in truths)
    assert same.ssim > built_in.ssim - 0.02
    assert itself.ssim > built_in.ssim - 0.03
    assert itself.psnr_db > image_quality(truths[0], before).psnr_db + 3


def test_the_command_and_python(mirrors: Path, hdr: Path, tmp_path: Path, cli: Command) -> None:
    out = tmp_path / "v.png"
    words = ["view", mirrors, *SMALL, "--light", hdr, "--out", out]
    said = cli(*words, "--light-turn", "90").out
    assert f"light {hdr}: by " in said
    assert "against the ray-traced picture" in said
    assert "lit by the same lamps" in said
    turned = np.asarray(Image.open(out))
    cli(*words, "--force")
    assert np.abs(np.asarray(Image.open(out)).astype(int) - turned).mean() > 1
    view = tbcad.view(tbcad.relight(mirrors, hdr), 20, 30, size=(64, 48), method="nearest")
    assert view.image.max() > 100


def test_the_same_bytes_each_time(
    captured: Path, record: Path, table: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again"
    assert run(["capture", str(record), "--lights", str(table), "--out", str(again)]) == 0
    for name in ("reflectance.h5", "lightfield.h5"):
        assert (again / name).read_bytes() == (captured / name).read_bytes()


@pytest.mark.parametrize("name", ["lamps/place", "a/transport", "lamps/name"])
def test_damaged_files_are_refused(captured: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "reflectance.h5").write_bytes((captured / "reflectance.h5").read_bytes())
    with h5py.File(tmp_path / "reflectance.h5", "r+") as store:
        del store[name]
    with pytest.raises(InputError, match="damaged"), open_reflectance(tmp_path):
        pass


def test_a_field_of_another_capture_is_refused(
    captured: Path, hdr: Path, light_field: LightField
) -> None:
    one = LightField({"c": light_field.frames["a"]}, light_field.capture_mm, {})
    with (
        open_reflectance(captured) as reflectance,
        pytest.raises(InputError, match="not of this light field"),
    ):
        relit(one, reflectance, read_environment(hdr))

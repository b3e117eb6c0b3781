"""What a design asks of a camera, against closed forms and the paper's design."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.camera.lists import (
    CAMERA_COLUMNS,
    LENS_COLUMNS,
    CameraBody,
    RectilinearLens,
    load_cameras,
    load_lenses,
)
from tbcad.core.camera.requirements import (
    CameraRequirements,
    DepthRange,
    Lens,
    aperture_stop,
    aperture_stops,
    blur_limited,
    camera_requirements,
    exposure_seconds,
    focal_length,
    image_distances,
    lens_for,
    sharpest,
)
from tbcad.core.camera.sheet import best_lenses, candidates
from tbcad.core.mirrors.array import MirrorArray
from tbcad.errors import InputError
from tbcad.types import Floats
from tests.mirror_arrays import mirror_array

# Of a fan's neighbouring ray from the apex, mm.
ALONG, ACROSS = np.array([1e-5, 0.0]), np.array([0.0, 1e-5])
LENS = Lens(pixel=0.00345, image=3.65, wide_open=2.8, wavelength=550e-6)
RANGE = DepthRange(150.0, 250.0)
NEEDED = CameraRequirements(90.0, 70.0, 2000, 1400, 100.0, 150.0, 120.0, 0.8, 2.0, 2.0, 2.8)
BODY = CameraBody("body", "M", 36.0, 27.0, 6000, 4500, "gphoto2", "test")
WIDE_LENS = RectilinearLens("lens", ("M",), 10, 30, 2.8, 40, 100.0, 60.0, "test")


def traced(curvature: float, incidence: float, distance: float, fan: Floats) -> float:
    """Distance behind a mirror of the image made by two neighbouring rays, by no formula.

    The sphere's apex is the origin, its normal z, the plane of incidence x, z. The image is where
    the neighbour, drawn backward, comes nearest to the principal ray.
    """
    source = distance * np.array([np.sin(incidence), 0.0, np.cos(incidence)])
    start, way = [], []
    for shift in (-0.5 * fan, 0.5 * fan):
        point = np.array([shift[0], shift[1], 0.0])
        radius = 1 / curvature
        point[2] = -(shift @ shift) / (radius + np.sqrt(radius**2 - shift @ shift))
        normal = (point + np.array([0.0, 0.0, radius])) / radius
        ray = (point - source) / np.linalg.norm(point - source)
        start.append(point)
        way.append(ray - 2 * (ray @ normal) * normal)
    between, difference = start[1] - start[0], way[1] - way[0]
    return float(between @ difference / (difference @ difference))


@pytest.mark.parametrize("curvature", [1 / 7, 1e-4])
@pytest.mark.parametrize("incidence_deg", [0.0, 35.0, 60.0])
@pytest.mark.parametrize("distance", [28.0, 138.0])
def test_coddington_agrees_with_traced_fans(
    curvature: float, incidence_deg: float, distance: float
) -> None:
    incidence = np.radians(incidence_deg)
    tangential, sagittal = image_distances(
        np.array(curvature), np.array(incidence), np.array(distance)
    )
    assert traced(curvature, incidence, distance, ALONG) == pytest.approx(tangential, rel=1e-4)
    assert traced(curvature, incidence, distance, ACROSS) == pytest.approx(sagittal, rel=1e-4)


@pytest.mark.parametrize(
    "settings", [["n=5"], ["n=4", "camera_mm=[100, 20, -110]", "capture_diameter_mm=40"]], ids=str
)
def test_depths_are_those_of_fans_traced_at_every_mirror(settings: list[str]) -> None:
    """Images of the ends of the capture sphere on each principal ray."""
    array, radius, depth = mirror_array(*settings), 20.0, []
    needed, mirrors, camera = camera_requirements(array, radius), array.mirrors, array.camera
    for apex, normal, k in zip(mirrors.apex, mirrors.normal, mirrors.curvature, strict=True):
        to_mirror, to_centre = np.linalg.norm(apex - camera.pinhole), np.linalg.norm(apex)
        way = (apex - camera.pinhole) / to_mirror
        incidence = float(np.arccos(-way @ normal))
        for distance in (to_centre - radius, to_centre + radius):
            for fan in (ALONG, ACROSS):
                image = to_mirror + traced(float(k), incidence, float(distance), fan)
                depth.append(float(image * (way @ camera.forward)))
    assert (needed.near_mm, needed.far_mm) == pytest.approx((min(depth), max(depth)), rel=1e-4)


def test_flat_mirrors_have_images_where_their_virtual_cameras_see_the_object() -> None:
    """Planar mirrors only fold the path: depths are 2a -+ R along rays to the apices."""
    array = mirror_array("n=6", "radius_rule=flat")
    needed = camera_requirements(array, 30.0)
    ray = array.mirrors.apex - array.camera.pinhole
    cosine = ray @ array.camera.forward / np.linalg.norm(ray, axis=1)
    distance = 2 * array.ellipsoid.semi_major
    assert needed.near_mm == pytest.approx((distance - 30) * cosine.min(), rel=1e-12)
    assert needed.far_mm == pytest.approx((distance + 30) * cosine.max(), rel=1e-12)


def test_all_corners_are_within_the_angles(paper_array: MirrorArray) -> None:
    needed, view = camera_requirements(paper_array, 30.0), paper_array.camera
    image = np.abs(view.project(paper_array.cells.corners) - [1039.5, 775.5])
    assert 2 * image[:, 0].max() == pytest.approx(needed.width_px, abs=1)
    assert 2 * image[:, 1].max() == pytest.approx(needed.height_px, abs=1)
    assert needed.hfov_deg < np.degrees(view.hfov)


def test_exposure_is_that_of_an_incident_light_meter() -> None:
    """ISO 2720: N^2 / t = E S / C with C = 250 lx s for a flat receptor; the mirror takes 45 %.

    18 % of the light against the meter's own 15.7 % (pi K / C) are a fifth of a stop.
    """
    seconds = exposure_seconds(16.0, 0.0, 100_000.0, 100.0) * 0.55
    meter = 16**2 * 250 / (100_000 * 100)
    assert seconds / meter == pytest.approx(math.pi * 12.5 / 250 / 0.18)
    assert exposure_seconds(8, 1.0, 1e4, 100) == pytest.approx(exposure_seconds(16, 0, 1e4, 100))


def spot(lens: Lens, over: DepthRange, depth: float, pupil: float, across: float) -> float:
    """Width on the sensor of rays from a point off the axis through both ends of the pupil."""
    f, hits = focal_length(lens, over), []
    for height in (-pupil / 2, pupil / 2):
        slope = (height - across) / depth
        bent = slope - height / f  # what a thin lens does to a slope
        hits.append(height + bent * lens.image)
    return abs(hits[1] - hits[0])


@pytest.mark.parametrize("across", [0.0, 120.0])
@pytest.mark.parametrize("depth", [150.0, 250.0])
def test_blur_is_that_of_rays_through_the_rim(depth: float, across: float) -> None:
    """The same at both ends of the range, on the axis and off it."""
    pupil = blur_limited(LENS, RANGE, 1.0)
    blur = spot(LENS, RANGE, depth, pupil, across) / LENS.pixel
    assert blur == pytest.approx(1.0, rel=1e-9)
    assert aperture_stop(LENS, RANGE, pupil)["blur_px"] == pytest.approx(blur, rel=1e-9)


def test_focus_is_sharp_and_half_the_width_is_seen_under_half_the_angle() -> None:
    assert spot(LENS, RANGE, RANGE.focus, 1.0, 50.0) == pytest.approx(0, abs=1e-12)
    assert RANGE.focus == pytest.approx(187.5, rel=1e-15)
    lens = lens_for(math.radians(89), 2080, 0.00345, 2.8)
    assert 2080 * 0.00345 / 2 / lens.image == pytest.approx(math.tan(math.radians(44.5)))


def test_airy_disc_of_a_known_stop() -> None:
    """F/8 far away at 550 nm: 2.44 * 0.55 um * 8 = 10.736 um."""
    lens = Lens(pixel=0.001, image=50.0, wide_open=1.0, wavelength=550e-6)
    found = aperture_stop(lens, DepthRange(1e9, 2e9), 50.0 / 8)
    assert found["f_number"] == pytest.approx(8, rel=1e-6)
    assert found["airy_px"] == pytest.approx(10.736, rel=1e-6)


def test_sharpest_stop_has_the_smallest_blur() -> None:
    best = aperture_stop(LENS, RANGE, sharpest(LENS, RANGE))
    pupils = np.linspace(0.1, 1.2, 2000)
    least = min(aperture_stop(LENS, RANGE, pupil)["total_px"] for pupil in pupils)
    assert best["total_px"] <= least
    assert best["total_px"] == pytest.approx(least, rel=1e-5)
    assert best["blur_px"] == pytest.approx(best["airy_px"], rel=1e-12)


def test_no_stop_is_wider_than_wide_open() -> None:
    """A shallow range would allow any pupil."""
    found = aperture_stops(LENS, DepthRange(200.0, 200.1), 1.0)
    assert found["blur limited"]["f_number"] == pytest.approx(2.8, rel=1e-12)
    assert found["sharpest"]["light"] == pytest.approx(1, rel=1e-12)
    assert found["blur limited"]["blur_px"] < 1


def only(body: CameraBody = BODY, lens: RectilinearLens = WIDE_LENS, needed=NEEDED):
    (one,) = candidates(needed, [body], [lens])
    return one


def test_the_longest_focal_length_that_shows_all() -> None:
    """18 mm from lens to sensor shows 90 degrees on 36 mm: 1/f = 1/18 + 1/120."""
    one = only()
    assert one.focal_mm == pytest.approx(1 / (1 / 18 + 1 / 120))
    assert one.pixels_across == pytest.approx(6000)
    assert one.magnification == pytest.approx(18 / 120)
    assert one.f_number == pytest.approx(one.focal_mm / 0.8)
    assert one.faults == ()
    assert one.close_up_dpt == 0


@pytest.mark.parametrize(
    ("lens", "body", "fault"),
    [
        (replace(WIDE_LENS, focal_min_mm=20), BODY, "of 90.0 degrees at 20 mm"),
        (replace(WIDE_LENS, image_circle_mm=40), BODY, "image circle 40 of 43.9 mm"),
        (WIDE_LENS, replace(BODY, width_px=1500), "1500 of 2000 pixels across the mirrors"),
        (replace(WIDE_LENS, f_number_max=4), BODY, "F/4 blurs by"),
    ],
)
def test_each_fault_is_named(lens: RectilinearLens, body: CameraBody, fault: str) -> None:
    assert any(fault in text for text in only(body, lens).faults)


def test_a_close_up_lens_brings_the_nearest_focus_to_where_it_is_needed() -> None:
    """A thin lens that focuses from 250 mm of the sensor, with the power added, at 120 mm."""
    one = only(lens=replace(WIDE_LENS, min_focus_mm=250))
    f = one.focal_mm
    s = 250 / 2 + (250**2 / 4 - f * 250) ** 0.5
    assert s + s * f / (s - f) == pytest.approx(250)
    assert one.close_up_dpt == pytest.approx(1000 / 120 - 1000 / s)


def test_those_without_faults_come_first() -> None:
    poor = replace(BODY, name="poor", width_px=1000)
    close = replace(WIDE_LENS, name="close-up", min_focus_mm=200)
    lists = [poor, BODY], [close, WIDE_LENS]
    first, second, *_ = candidates(NEEDED, *lists)
    assert (first.camera, first.lens) == (BODY, WIDE_LENS)
    assert (second.camera, second.lens) == (BODY, close)
    best = best_lenses(NEEDED, *lists)
    assert [one.camera for one in best] == [BODY, poor]
    assert best[0] == first


def test_built_in_lists_are_sound() -> None:
    for body in load_cameras():
        height = body.height_px * body.pixel_mm
        assert height == pytest.approx(body.height_mm, rel=0.01)
    mounts = {body.mount for body in load_cameras()}
    assert all(any(lens.fits(mount) for mount in mounts) for lens in load_lenses())


@pytest.mark.parametrize(
    ("table", "text", "message"),
    [
        ("cameras", "x,M,36,24,60,40,g,,,,,,,,", "line 2, column source: empty"),
        ("cameras", "x,M,0,24,60,40,g,,,,,,,,s", "column sensor_width_mm: '0', allowed is a"),
        ("cameras", "x,M,36,24,60,40,g,,90,-1,,,,,s", "column body_height_mm: '-1', allowed"),
        ("cameras", "Canon EOS R5,M,36,24,60,40,g,,,,,,,,s", "column name: 'Canon EOS R5' twice"),
        ("lenses", "x,M,20,15,2.8,22,0.2,43,,,,s", "column focal_max_mm: 15, allowed is 20 or"),
        ("lenses", "x,M,20", "3 columns, not 12"),
    ],
)
def test_users_lists_are_refused_by_line(
    tmp_path: Path, table: str, text: str, message: str
) -> None:
    file = tmp_path / "mine.csv"
    columns, load = {
        "cameras": (CAMERA_COLUMNS, load_cameras),
        "lenses": (LENS_COLUMNS, load_lenses),
    }[table]
    file.write_text(",".join(columns) + "\n" + text + "\n")
    with pytest.raises(InputError, match=r"mine\.csv, line 2") as caught:
        load(file)
    assert message in str(caught.value)

"""The ring of LEDs: where it is, what it lights, what is written of it, and what is refused."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.mirror_light import Lamps, light_by_mirrors, lit_mirrors
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.purchased.parts import load_parts
from tbcad.shell_lamps.files import LIST, WIRING, printed_ring, ring_record, write_ring
from tbcad.shell_lamps.ring import LampRing, facing, lamp_ring
from tests.mirror_arrays import mirror_design

PARTS = load_parts()


def asked(design: MirrorDesign, **keys: object) -> LampRing | None:
    lamps = design.spec.shell.lamps.model_copy(update=keys)
    shell = design.spec.shell.model_copy(update={"lamps": lamps})
    return lamp_ring(replace(design, spec=design.spec.model_copy(update={"shell": shell})), PARTS)


@pytest.fixture(scope="module")
def ring(small_design: MirrorDesign) -> LampRing:
    found = lamp_ring(small_design, PARTS)
    assert found is not None
    return found


def test_six_leds_round_each_lens_in_the_plane_of_its_front(
    ring: LampRing, small_design: MirrorDesign
) -> None:
    for array in small_design.arrays:
        camera, places = array.camera, ring.places(array.camera)
        beside = places - camera.pinhole
        assert beside @ camera.forward == pytest.approx(np.full(6, ring.front))
        off = np.linalg.norm(beside - ring.front * camera.forward, axis=1)
        assert off == pytest.approx(np.full(6, ring.circle))
        boards = np.linalg.norm(places[0] - places[1])
        assert boards > ring.led["diameter_mm"]
    a, b = (ring.places(array.camera) for array in small_design.arrays)
    assert sorted(map(tuple, (a * [-1, 1, 1]).round(6))) == sorted(map(tuple, b.round(6)))


def test_the_camera_does_not_see_it(ring: LampRing, small_design: MirrorDesign) -> None:
    camera = small_design.arrays[0].camera
    corner = np.tan(camera.hfov / 2) * np.hypot(1, camera.height_px / camera.width_px)
    assert ring.front * corner < ring.bore / 2


def test_surfaces_that_face_all_ways_get_light_within_a_factor_of_four(
    ring: LampRing,
) -> None:
    low, mean, high = ring.lux
    assert 3e3 < low < mean < high < 1.2e4
    assert high / low < 3


def test_current_and_resistor_are_what_the_supply_gives(ring: LampRing) -> None:
    drop = 24 - 6 * 2.8
    assert ring.resistor.current_ma == pytest.approx(1e3 * drop / ring.resistor.ohm)
    assert 90 < ring.resistor.current_ma <= 100
    assert ring.candela == pytest.approx(40 / np.pi * ring.resistor.current_ma / 100)
    assert ring.watt == pytest.approx(24e-3 * ring.resistor.current_ma)


def test_lists_have_what_both_rings_need(
    ring: LampRing, small_design: MirrorDesign, tmp_path: Path
) -> None:
    part = printed_ring(ring, small_design.spec.printer)
    write_ring(small_design.spec, ring, part, tmp_path)
    with (tmp_path / LIST).open() as file:
        rows = {row["part"]: row for row in csv.DictReader(file)}
    assert int(rows["STAR-3535"]["quantity"]) == 12
    assert int(rows["lamp_ring"]["quantity"]) == 2
    assert int(rows[ring.resistor.part.name]["quantity"]) == 2
    assert all(row["total_price"] for row in rows.values())
    with (tmp_path / WIRING).open() as file:
        lines = list(csv.DictReader(file))
    assert [float(line["forward_v"]) for line in lines] == [16.8, 16.8]
    assert {path.suffix for path in tmp_path.glob("lamp_ring.*")} == {".step", ".stl", ".3mf"}
    record = ring_record(ring, part, small_design)
    assert [one.camera for one in record.places] == ["a"] * 6 + ["b"] * 6
    assert record.watt == pytest.approx(2 * ring.watt)


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"leds": 6, "front_mm": 60.0}, "the camera sees the ring"),
        ({"leds": 8, "lens_mm": 200.0}, "the rings of both cameras meet"),
    ],
)
def test_refused(small_design: MirrorDesign, keys: dict[str, object], told: str) -> None:
    with pytest.raises(SpecError, match=told):
        asked(small_design, **keys)


def test_none_where_none_is_asked_for_or_has_room(small_design: MirrorDesign) -> None:
    assert asked(small_design, leds=0) is None
    assert asked(small_design, lens_mm=200.0) is None
    flat = mirror_design("n=6", "mirrors.radius_rule=flat")
    assert lamp_ring(flat, PARTS) is None


def test_auto_leaves_out_what_dazzles_or_lights_unevenly() -> None:
    """Asked for by number they are there: LEDs are large beside a small machine."""
    small = ("optics.camera_mm=[61.3, 0, -51.4]", "semi_minor_mm=82.6", "capture_diameter_mm=35")
    low = ("optics.camera_mm=[135, 0, -85.4]", "semi_minor_mm=131.7", "capture_diameter_mm=52.6")
    for optics in (small, low):
        design = mirror_design("n=3", *optics)
        assert lamp_ring(design, PARTS) is None
        found = asked(design, leds=6)
        assert found is not None
        assert found.even == (optics is small)


def test_a_candela_beside_each_lens_lights_the_upper_hemisphere(
    paper_design: MirrorDesign,
) -> None:
    """124 to 249 lx a candela that shines alike to all sides; a Lambertian one gives less."""
    normals = facing(15.0)
    upper, total = normals[:, 2] >= 0, np.zeros(len(normals))
    cameras = [array.camera for array in paper_design.arrays]
    pinholes, forward = np.array([[one.pinhole, one.forward] for one in cameras]).swapaxes(0, 1)
    lamps = Lamps(pinholes, forward, np.ones(2))
    for array, side in zip(paper_design.arrays, (1.0, -1.0), strict=True):
        mirrors = lit_mirrors(array.mirrors, side, array.foot)
        total += light_by_mirrors(lamps, mirrors, 20 * normals, normals, 20.0)
    assert 100 < total[upper].min() < 124
    assert 190 < total[upper].max() < 249
    assert total[upper].max() < 2 * total[upper].min()

"""Lamps that light unevenly, dazzle, or are not where their ring is, are refused."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tbcad_verify.mesh.mesh import Mesh, mesh_from_facets
from tbcad_verify.mesh.stl import read_facets
from tbcad_verify.prototype.measured_parts import put_back
from tbcad_verify.record.export import ShellLamp, ShellLamps, read_export
from tbcad_verify.record.poses import contradictions
from tbcad_verify.record.spec import ShellLampsSpec
from tbcad_verify.report.checks import Check, Unknown
from tbcad_verify.run.stages import stage_titles
from tbcad_verify.shell import lamps as lamps_of
from tbcad_verify.shell.optics import OpticalSetup

from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.output.build import write_export
from tbcad.output.parts import SHELL
from tbcad.records.design import DesignRecord
from tests.exported_files import edit_json
from tests.verify.optical_setups import optical_setup_of


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lamps")
    write_export(design(load_spec(None, ["n=4", "width_px=200", "height_px=150"])), folder, [SHELL])
    return folder


@pytest.fixture(scope="module")
def setup(good: Path) -> OpticalSetup:
    return optical_setup_of(good)


@pytest.fixture(scope="module")
def ring(good: Path, setup: OpticalSetup) -> Mesh:
    (part,) = setup.export.rings
    return put_back(mesh_from_facets(read_facets(good, part.stl)[0]), part)


@pytest.fixture
def lamps(setup: OpticalSetup) -> ShellLamps:
    assert setup.export.lamps is not None
    return setup.export.lamps


@pytest.fixture(autouse=True)
def fewer_bundles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lamps_of, "BUNDLES", 20_000)


def by_name(checks: list[Check]) -> dict[str, Check]:
    return {check.name: check for check in checks}


def changed(lamps: ShellLamps, how: Callable[[ShellLamp], dict[str, Any]]) -> ShellLamps:
    places = [one.model_copy(update=how(one)) for one in lamps.places]
    return lamps.model_copy(update={"places": places})


def test_a_good_ring_passes_and_gives_the_light_of_the_design(
    good: Path, lamps: ShellLamps, ring: Mesh, setup: OpticalSetup
) -> None:
    found = by_name(lamps_of.checks(lamps, ring, setup))
    assert [check.passed for check in found.values()] == [True] * 4
    assert "lamps" in stage_titles(setup.export)
    # Two tracers that share nothing: closed form of each sphere, and bundles counted on patches.
    told = DesignRecord.read(good / "design.json").lamps
    assert told is not None
    lux = lamps_of.object_light(lamps, setup) * told.candela * np.pi / 40
    assert lux.mean() == pytest.approx(told.lux[1], rel=0.03)


def test_bundles_carry_the_light_of_the_led() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    flux, way = lamps_of.bundles(40.0, axis)
    assert flux.sum() == pytest.approx(40.0)
    assert np.linalg.norm(way, axis=0) == pytest.approx(1)
    # A Lambertian lamp: half of its light within 45 degrees.
    assert flux[axis @ way > np.sqrt(0.5)].sum() == pytest.approx(20.0, rel=1e-3)


def test_leds_of_one_camera_alone_light_unevenly(
    lamps: ShellLamps, ring: Mesh, setup: OpticalSetup
) -> None:
    one = lamps.model_copy(update={"places": [p for p in lamps.places if p.camera == "a"]})
    found = by_name(lamps_of.checks(one, ring, setup))
    assert not found["light ratio"].passed
    assert not found["lamp ring"].passed


def test_large_leds_dazzle(
    lamps: ShellLamps, ring: Mesh, setup: OpticalSetup, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(lamps_of.LEDS, "STAR-3535", (40.0, 30.0))
    assert not by_name(lamps_of.checks(lamps, ring, setup))["glare of lamps"].passed


@pytest.mark.parametrize(
    ("how", "told"),
    [
        (lambda one: {"position": one.position + np.array([3.0, 0, 0])}, "behind the ring"),
        (lambda one: {"position": one.position * 1.1}, "in no window"),
        (lambda one: {"direction": -one.direction}, "does not face forward"),
    ],
)
def test_leds_that_are_elsewhere_than_their_windows(
    how: Callable[[ShellLamp], dict[str, Any]],
    told: str,
    lamps: ShellLamps,
    ring: Mesh,
    setup: OpticalSetup,
) -> None:
    camera = setup.cameras[0]
    assert lamps_of.ring_faults(lamps, ring, camera) == []
    faults = lamps_of.ring_faults(changed(lamps, how), ring, camera)
    assert any(told in fault for fault in faults)


def test_a_ring_in_its_cameras_view(lamps: ShellLamps, ring: Mesh, setup: OpticalSetup) -> None:
    ahead = lamps.model_copy(update={"front_mm": 60.0})
    faults = lamps_of.ring_faults(ahead, ring, setup.cameras[0])
    assert any("sees the ring" in fault for fault in faults)
    solid = replace(ring, points=ring.points * [0.5, 0.5, 1])
    assert lamps_of.ring_faults(lamps, solid, setup.cameras[0])


@pytest.mark.parametrize("asked", [{"leds": 4}, {"lens_mm": 50.0}, {"front_mm": 3.0}])
def test_another_ring_than_the_design_asks_for(
    asked: dict[str, Any], lamps: ShellLamps, ring: Mesh
) -> None:
    every = {"leds": 6, "lens_mm": 60.0, "front_mm": lamps.front_mm}
    assert lamps_of.asked_faults(ShellLampsSpec(**every), lamps, ring) == []
    assert lamps_of.asked_faults(ShellLampsSpec(**every | asked), lamps, ring)


def test_lamps_that_are_asked_for_and_missing(good: Path, tmp_path: Path) -> None:
    for path in good.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())

    def missing(record: dict[str, Any]) -> None:
        record["spec"]["shell"]["lamps"]["leds"] = 6
        del record["lamps"]

    edit_json(tmp_path / "design.json", missing)
    assert contradictions(read_export(tmp_path)) == ["the lamps of shell.lamps.leds"]


def test_an_unknown_led_is_no_pass(lamps: ShellLamps, ring: Mesh, setup: OpticalSetup) -> None:
    with pytest.raises(Unknown, match="no LED that is known"):
        lamps_of.checks(lamps.model_copy(update={"led": "OTHER"}), ring, setup)

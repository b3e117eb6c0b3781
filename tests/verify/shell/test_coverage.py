"""Coverage against closed forms and against brute force on the exact cells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tbcad_verify.mesh.mesh import Mesh, indexed_mesh
from tbcad_verify.mesh.rays import build_scene
from tbcad_verify.mesh.surfaces import ReflectedRays, prepare_for_rays
from tbcad_verify.record.poses import VirtualCameras
from tbcad_verify.shell import coverage
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.shell.outline import (
    SAMPLES,
    Outline,
    minimum_miss_distance,
    reflect_on_facets,
    reflect_on_fits,
    trace_outline,
    winding_numbers,
)
from tbcad_verify.shell.recover import recover

from tests.verify.optical_setups import optical_setup_of
from tests.verify.synthetic_export import PIN, Cells, Design, export, poses, unit

ONE = VirtualCameras(np.array([0]), 1, np.array([False]))


def measured(mesh: Mesh, pinhole: np.ndarray, coat: float = 0.0) -> tuple[float, float, float]:
    """Coverage of the only mirror of a mesh, on facets and fitted, and turns of its outline."""
    found = recover(mesh, pinhole, 30)
    assert found.mirror.sum() == 1
    owner = np.where(found.mirror, 0, -1)
    outline = trace_outline(mesh, found, owner, coat, np.array([True]), ONE.halved)
    seen = prepare_for_rays(
        pinhole, found.fits.surfaces.take(np.flatnonzero(found.mirror)).coated(coat)
    )
    fitted = reflect_on_fits(outline, seen)
    facets = reflect_on_facets(outline, pinhole, build_scene(mesh))
    u = unit(np.array([0.0, 0, 1]))[:, None]
    return (
        2 * minimum_miss_distance(outline, facets, ONE)[0],
        2 * minimum_miss_distance(outline, fitted, ONE)[0],
        abs(winding_numbers(outline, fitted, ONE, u)[0]),
    )


@pytest.mark.parametrize("widest", [0.3, 1.4, 1.9])
def test_an_outline_may_send_light_sideways_and_back(widest: float) -> None:
    """Lines through a focus above the origin fan out, by an angle that varies along the outline."""
    edges = 24
    turn = (np.arange(edges)[:, None] + SAMPLES).ravel() * 2 * np.pi / edges
    fan = widest * (1 + 0.2 * np.cos(turn))
    sideways = np.sin(fan) * np.stack([np.cos(turn), np.sin(turn), 0 * turn])
    toward = sideways - np.cos(fan) * np.array([0.0, 0, 1])[:, None]
    focus = np.array([0.0, 0, 8])[:, None] + 0 * toward
    lines = ReflectedRays(focus, toward, np.ones(turn.size))
    none, places = np.zeros(turn.size, dtype=np.int64), np.zeros_like(toward)
    outline = Outline(none, none, places, places, places, none > 0)
    u = np.array([0.0, 0, 1])[:, None]
    assert abs(winding_numbers(outline, lines, ONE, u)[0]) == pytest.approx(1)
    moved = replace(lines, point=focus + np.array([20.0, 0, 0])[:, None])
    if widest < 1:
        assert winding_numbers(outline, moved, ONE, u)[0] == pytest.approx(0, abs=1e-9)


def plate(width: float, place: np.ndarray, pinhole: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """A square plate that reflects the pinhole to the origin; its front's corners in order."""
    n = unit(unit(pinhole - place) + unit(-place))
    e = unit(np.cross(n, [0.1, 1, 0]))
    turn = np.stack([e, np.cross(n, e), n])
    box = trimesh.creation.box((width, width, 2.0))
    points = (box.vertices - [0, 0, 1]) @ turn + place
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * width / 2 @ turn + place
    return indexed_mesh(points, box.faces.astype(np.int32)), corners


@pytest.mark.parametrize("width", [4.0, 12.0, 25.0])
def test_a_square_flat_mirror(width: float) -> None:
    """All rays come from the pinhole's image; the nearest lies in the plane of image and edge."""
    place = np.array([5.0, -3, 60])
    mesh, corners = plate(width, place, PIN)
    n = unit(unit(PIN - place) + unit(-place))
    image = PIN - 2 * ((PIN - place) @ n) * n
    fans = np.cross(corners - image, np.roll(corners, -1, axis=0) - image)
    expected = 2 * np.abs(unit(fans) @ image).min()
    facets, fitted, turned = measured(mesh, PIN)
    assert facets == pytest.approx(expected, rel=1e-4)
    assert fitted == pytest.approx(expected, rel=1e-4)
    assert turned == pytest.approx(1)


def test_a_flat_mirror_beside_the_object_does_not_surround_it() -> None:
    mesh, _ = plate(4.0, np.array([5.0, -3, 60]), PIN)
    aside = indexed_mesh(mesh.points + np.array([4, 0, 0]), mesh.faces)
    assert measured(aside, PIN)[2] == pytest.approx(0, abs=1e-9)


def dome(radius: float, angle: float, height: float, steps: int = 24) -> Mesh:
    """A spherical cap about the z axis, top at the height, bulging down, with a lid above."""
    a = np.concatenate([np.linspace(0, angle, steps)[:-1], [angle * (1 - 1e-4), angle]])
    outline = np.column_stack([radius * np.sin(a), height + radius * (1 - np.cos(a))])
    whole = trimesh.creation.revolve(np.vstack([outline, [0, height + 30]]), sections=240)
    return indexed_mesh(np.array(whole.vertices), whole.faces.astype(np.int32))


@pytest.mark.parametrize(
    ("radius", "angle", "coat"),
    [(20.0, 0.1, 0.0), (20.0, 0.1, 0.2), (8.0, 0.25, 0), (60.0, 0.08, 0)],
)
def test_one_sphere_on_the_axis(radius: float, angle: float, coat: float) -> None:
    """Pinhole and object on the sphere's axis: every ray to the rim passes at one distance.

    The wall round the cap has no coat: the coated rim lies where the coat meets the wall. The lid
    is a cone of many sides, no plane or sphere: the coat's rim is straight above.
    """
    height, pinhole = 58.0, np.array([0, 0, -120.0])
    normal = np.array([np.sin(angle), -np.cos(angle)])
    x, z = np.array([0, height + radius]) + (radius + coat) * normal
    out = np.arctan2(x, z - pinhole[2]) + 2 * angle  # from the axis, downward
    expected = 2 * (x * np.cos(out) + z * np.sin(out))
    facets, fitted, turned = measured(dome(radius, angle, height), pinhole, coat)
    assert fitted == pytest.approx(expected, rel=2e-4)  # chords of a 240-gon
    assert facets == pytest.approx(expected, rel=1e-2)  # rim facets turned by half a step
    assert turned == pytest.approx(1)


def oracle(cells: Cells) -> dict[int, float]:
    """Coverage of camera a's whole mirrors by number: exact outlines on exact spheres."""
    found = {}
    for k, mirror in enumerate(cells.mirrors):
        x = np.array([p for p, _ in cells.outlines[k]])
        centre, radius, normal = cells.spheres[k]
        n = np.broadcast_to(normal, x.shape) if radius is None else (x - centre) / radius
        d = x - PIN
        r = unit(d - 2 * np.einsum("ij,ij->i", d, n)[:, None] * n)
        miss = np.linalg.norm(x - np.einsum("ij,ij->i", x, r)[:, None] * r, axis=1)
        cut = np.array([beyond == -1 for _, beyond in cells.outlines[k]])
        found[mirror["number"]] = 2 * miss[~cut].min()
    return found


@pytest.fixture(scope="module")
def fine() -> Cells:
    """The good export's, their arcs with many more points."""
    return Cells(Design(arc=80), poses(Design()))


@pytest.fixture(scope="module")
def found(optical_setup: OpticalSetup) -> coverage.Coverage:
    return coverage.measure(optical_setup)


def check_fitted(
    optical_setup: OpticalSetup, found: coverage.Coverage, expected: dict[int, float], mm: float
) -> None:
    """Coverage of camera a's whole mirrors, within so many millimetres."""
    for v, name in enumerate(optical_setup.virtual_ids):
        if name.startswith("a"):
            assert found.fitted[v] == pytest.approx(expected[int(name[1:])], abs=mm), name


def test_every_mirror_against_brute_force(
    optical_setup: OpticalSetup, found: coverage.Coverage, fine: Cells
) -> None:
    expected = oracle(fine)
    check_fitted(optical_setup, found, expected, 0.08)
    check_fitted(optical_setup, replace(found, fitted=found.facet), expected, 3.0)
    assert not found.hidden.any()


def test_flat_mirrors_are_recovered_and_covered(tmp_path: Path) -> None:
    folder, _ = export(tmp_path / "x", Design(flat=True, target=15.0))
    optical_setup = optical_setup_of(folder)
    assert (optical_setup.match.segment >= 0).all()
    assert optical_setup.match.centre_error.max() < 1e-4
    assert (optical_setup.match.radius_error == 0).all()
    found = coverage.measure(optical_setup)
    fine = Cells(Design(flat=True, arc=80), poses(Design(flat=True)))
    check_fitted(optical_setup, found, oracle(fine), 0.05)
    # DESIGN.md section 3 has 21.0 mm at n = 4, there as 2 d sin theta_0, on the whole sphere.
    assert found.facet.min() == pytest.approx(21.0, abs=1.0)


def test_halves_share_their_coverage(optical_setup: OpticalSetup, found: coverage.Coverage) -> None:
    index = optical_setup.virtual.index
    ids = optical_setup.export.mirrors.ids
    halves = [k for k in range(len(ids)) if optical_setup.virtual.halved[k]]
    assert len(halves) == 18
    for k in halves:
        other = ids.index(("b" if ids[k][0] == "a" else "a") + ids[k][1:])
        assert index[k] == index[other]
        # Were the cut counted, a half would see next to nothing.
        assert found.fitted[index[k]] > 40


def test_a_lost_half_is_no_coverage(optical_setup: OpticalSetup) -> None:
    half = int(np.flatnonzero(optical_setup.virtual.halved)[0])
    segment = optical_setup.match.segment.copy()
    segment[half] = -1
    found = coverage.measure(
        replace(optical_setup, match=replace(optical_setup.match, segment=segment))
    )
    assert np.isnan(found.fitted[optical_setup.virtual.index[half]])
    lines = {c.name: c for c in coverage.checks(optical_setup, found, "x")[0]}
    assert lines["coverage, spheres"].passed is False
    assert optical_setup.export.mirrors.ids[half] in lines["coverage, spheres"].detail
    assert lines["seam gap"].passed is False
    name = optical_setup.virtual_ids[optical_setup.virtual.index[half]]
    assert f"a half is missing: {name}" in lines["seam gap"].detail


def test_a_coated_export_is_verified_like_a_bare_one(tmp_path: Path, fine: Cells) -> None:
    """The record speaks of the coated spheres: with the coat on, the same mirrors see the same."""
    folder, _ = export(tmp_path / "x", Design(coating=0.05))
    optical_setup = optical_setup_of(folder)
    assert optical_setup.match.radius_error.max() < 1e-3
    found = coverage.measure(optical_setup)
    check_fitted(optical_setup, found, oracle(fine), 0.1)


def brute_force_gaps(cells: Cells, radius: float) -> dict[str, float]:
    """Where each half's cut is imaged, from exact circles, and the room between the two, mm."""
    gaps = {}
    for k, m in enumerate(cells.mirrors):
        if m["u"][0] > 1e-9:
            continue
        x = np.array([p for p, beyond in cells.outlines[k] if beyond == -1])
        n = (x - m["c"]) / m["r"]
        d = x - PIN
        r = d - 2 * np.einsum("ij,ij->i", d, n)[:, None] * n
        at = x - ((x @ m["u"]) / (r @ m["u"]))[:, None] * r
        s = at @ np.cross(m["u"], [1.0, 0, 0])
        order = np.argsort(s)
        height = np.linspace(-radius, radius, coverage.STEPS)
        curve = np.interp(height, s[order], at[order, 0])
        # Camera a looks at x > curve, camera b, its mirror image, at x < -curve.
        chord = np.sqrt(radius**2 - height**2)
        gap = np.clip(2 * np.minimum(np.abs(curve), chord) * np.sign(curve), 0, None).max()
        gaps[f"a{m['number']:04d}"] = gap
    return gaps


def test_seam_gap_against_brute_force(tmp_path: Path) -> None:
    design = Design(aim=0.0)
    setup = optical_setup_of(export(tmp_path / "x", design)[0])
    found, radius = coverage.measure(setup), setup.radius
    gaps = dict(zip(setup.virtual_ids, found.gap, strict=True))
    for name, expected in brute_force_gaps(Cells(Design(arc=80), poses(design)), radius).items():
        assert gaps.pop(name) == pytest.approx(expected, abs=0.04)  # chords for arcs
    assert set(gaps.values()) == {0.0}  # of whole mirrors
    assert found.gap.max() > 1
    wide = found.gap > 0
    assert (found.fitted[wide] <= 2 * radius - found.gap[wide]).all()
    lines = {c.name: c for c in coverage.checks(setup, found, "x")[0]}
    assert lines["seam gap"].passed is False
    assert setup.virtual_ids[int(found.gap.argmax())] in lines["seam gap"].detail
    assert lines["coverage, spheres"].passed is False


def test_halves_aimed_beyond_the_seam_leave_no_gap(
    optical_setup: OpticalSetup, found: coverage.Coverage, fine: Cells
) -> None:
    assert max(brute_force_gaps(fine, optical_setup.radius).values()) == 0
    assert (found.gap == 0).all()
    lines = {c.name: c for c in coverage.checks(optical_setup, found, "x")[0]}
    assert lines["seam gap"].passed is True
    assert lines["seam gap"].limit == 0

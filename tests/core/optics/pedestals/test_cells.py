"""Mirrors on pedestals against slow oracles: dense outlines, half-spaces and balls, rays."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.cells import Cells, cell_areas
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES, NotRegularError
from tbcad.core.optics.reflection import reflect
from tbcad.core.spec.errors import SpecError
from tests.mirror_arrays import mirror_array
from tests.pedestal_designs import pedestal_design, pedestals

CAPTURE_RADIUS = 30.3  # with the margin


@pytest.fixture(scope="module")
def array() -> MirrorArray:
    return mirror_array("n=6")


@pytest.fixture(scope="module")
def cells(array: MirrorArray) -> PedestalCells:
    return pedestals(array)


def along_arcs(cells: Cells, samples: int) -> np.ndarray:
    shape = len(cells.arcs), samples
    arc = np.broadcast_to(np.arange(shape[0])[:, None], shape)
    return cells.arcs.at(arc, np.broadcast_to(np.linspace(0, 1, samples), shape))


@pytest.mark.parametrize("n", [2, 5])
@pytest.mark.parametrize("rule", ["traced", "paper", "flat"])
def test_every_edge_lies_on_both_its_faces_and_the_surface_is_one_piece(n: int, rule: str) -> None:
    cells = pedestals(mirror_array(f"n={n}", f"radius_rule={rule}"))
    points = along_arcs(cells, 7)
    for face in cells.arcs.faces.T:
        assert np.abs(cells.surfaces.value(face[:, None], points)).max() < 1e-9
    corners = len(np.unique([cells.arcs.start, cells.arcs.end]))
    assert corners - len(cells.arcs) + cells.mirrors + len(cells.walls) == 1


def test_bottoms_of_grooves_part_the_picture_without_gaps(
    array: MirrorArray, cells: PedestalCells
) -> None:
    """Seen from the pinhole, every direction to the mirrors' middles' hull is in one cell."""
    layout = cells.layout
    pinhole, bottom = layout.pinhole, layout.corners.bottom
    start, end = (bottom[layout.borders.ends[:, k]] - pinhole for k in (0, 1))
    normal = np.cross(start, end)
    apex = array.mirrors.apex
    share = np.random.default_rng(0).dirichlet(np.ones(4), size=400)
    some = np.random.default_rng(1).integers(len(apex), size=(400, 4))
    ray = np.einsum("rk,rkx->rx", share, apex[some] - pinhole)
    inside = np.ones((len(ray), cells.mirrors), dtype=bool)
    for side, (a, b) in enumerate(layout.borders.faces):
        for mine, other in ((a, b), (b, a)):
            if mine < cells.mirrors and other < cells.mirrors:
                sign = np.sign(normal[side] @ (apex[mine] - apex[other]))
                inside[:, mine] &= sign * (ray @ normal[side]) > 0
    assert (inside.sum(axis=1) == 1).mean() > 0.99  # cells at the rim are open: some overlap there
    assert inside.any(axis=1).all()


def test_areas_agree_with_spherical_triangles(cells: PedestalCells) -> None:
    offsets, sides = cells.rings
    every = along_arcs(cells, 400)[sides // 2, :-1]  # no side goes back along its arc
    areas = []
    for k in range(cells.mirrors):
        radius = cells.mirror_surfaces.radius[k]
        ring = unit(
            every[offsets[k] : offsets[k + 1]].reshape(-1, 3) - cells.mirror_surfaces.centre[k]
        )
        middle = unit(ring.mean(axis=0))
        after = np.roll(ring, -1, axis=0)
        triple = np.cross(ring, after) @ middle
        flat = 1 + dot(ring, after) + ring @ middle + after @ middle
        areas.append(-2 * np.arctan2(triple, flat).sum() * radius**2)
    np.testing.assert_allclose(cell_areas(cells), areas, rtol=1e-5)


def solids_entered(cells: PedestalCells, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Length (r, m) of each segment inside each pedestal: its ball between walls, seam and foot."""
    m, along = cells.mirrors, end - start
    g, h, k = (
        getattr(cells.mirror_surfaces, name)
        for name in ("gradient_at_origin", "value_at_origin", "curvature")
    )
    value = k / 2 * dot(start, start)[:, None] + start @ g.T + h
    slope, squared = along @ g.T + k * dot(start, along)[:, None], k * dot(along, along)[:, None]
    root = np.sqrt(np.maximum(slope**2 - 2 * squared * value, 0))
    met = slope**2 > 2 * squared * value
    low = np.where(met, np.maximum((-slope - root) / squared, 0), 1)
    high = np.where(met, np.minimum((-slope + root) / squared, 1), 0)
    normal, apex = cells.surfaces.normal[m:], cells.surfaces.apex[m:]
    cut = [(slice(None), -n, p) for n, p in zip(normal[:PLANES], apex[:PLANES], strict=True)]
    walls = zip(cells.walls[:, 0].tolist(), normal[PLANES:], apex[PLANES:], strict=True)
    for mirror, n, p in [*cut, *walls]:
        at, rate = (start - p) @ n, along @ n  # outside where at + t rate > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -at / rate
        enters, leaves = np.where(rate < 0, crossing, 0), np.where(rate > 0, crossing, 1)
        if isinstance(mirror, slice):
            enters, leaves = enters[:, None], leaves[:, None]
        low[:, mirror] = np.maximum(low[:, mirror], enters)
        high[:, mirror] = np.minimum(high[:, mirror], leaves)
    return np.maximum(high - low, 0) * norm(along)[:, None]


def points_on_mirrors(cells: PedestalCells) -> tuple[np.ndarray, np.ndarray]:
    """Mirror (k,) and place (k, 3) of points along the outlines, and of some farther inside."""
    sides = cells.rings[1] // 2
    edge = along_arcs(cells, 9)[sides].reshape(-1, 3)
    mirror = np.repeat(cells.arcs.left[sides], 9)
    middle = cells.mirror_surfaces.apex[mirror]
    inside = [
        cells.mirror_surfaces.projected(mirror, middle + share * (edge - middle))
        for share in (0.98, 0.9, 0.8, 0.6)
    ]
    return np.tile(mirror, 5), np.concatenate([edge, *inside])


def test_no_pedestal_stands_in_the_light_of_another_mirror(cells: PedestalCells) -> None:
    pinhole = cells.layout.pinhole
    mirror, point = points_on_mirrors(cells)
    normal = cells.surfaces.gradient(mirror, point)
    ray = reflect(unit(point - pinhole), normal)
    passing = point - dot(point, ray)[:, None] * ray
    useful = norm(passing) <= CAPTURE_RADIUS
    others = np.arange(cells.mirrors) != mirror[:, None]
    start = np.broadcast_to(pinhole, point.shape)
    assert (solids_entered(cells, start, point) * others).max() < 1e-9
    assert (solids_entered(cells, point, passing) * others)[useful].max() < 1e-9
    # The oracle finds what stands in the way: light from mirrors 5 mm below their neighbours' tops.
    raised = cells.with_mirrors(cells.mirror_surfaces.offset(5.0))
    assert (solids_entered(raised, point, passing) * others).max() > 0.1


def test_a_groove_wider_than_a_mirror_is_refused(array: MirrorArray) -> None:
    with pytest.raises(NotRegularError, match="groove"):
        pedestals(array, 30.0)


def modelled(*settings: str) -> PedestalCells:
    cells = pedestal_design(*settings).arrays[0].modelled_cells
    assert isinstance(cells, PedestalCells)
    return cells


def heights(cells: PedestalCells) -> np.ndarray:
    """Distances (c, 2) of all corners from the seam and the foot plane, inward."""
    planes = slice(cells.mirrors, cells.mirrors + PLANES)
    apex, normal = cells.surfaces.apex[planes], cells.surfaces.normal[planes]
    return np.einsum("cpx,px->cp", cells.corners[:, None] - apex, normal)


# Mirrors of n = 3 and 8 have borders of less than 2 mm with the foot; those of the others have
# ends of grooves near the seam.
@pytest.mark.parametrize(
    "settings", [("n=3", "groove_mm=0.05"), ("n=8",), ("n=9", "groove_mm=0.5")]
)
def test_nothing_sticks_out_and_no_tip_is_close_above_the_foot(settings: tuple[str, ...]) -> None:
    cells = modelled(*settings)
    assert heights(cells).min() > -1e-9
    tips = heights(cells)[: len(cells.rings[1]), 1]
    assert not ((tips > 1e-9) & (tips < cells.layout.groove)).any()


@pytest.mark.parametrize(
    ("settings", "wrong"),
    [
        (("n=20", "groove_mm=0.5"), r"groove.*: make shell\.groove_mm or optics\.n smaller"),
        (("n=4", "coating_um=200", "groove_mm=0.02"), r"coating_um 200 .* shell\.groove_mm larger"),
    ],
    ids=["crosses the seam", "coat too thick"],
)
def test_grooves_that_cannot_be(settings: tuple[str, ...], wrong: str) -> None:
    with pytest.raises(SpecError, match=wrong):
        modelled(*settings)


@pytest.mark.slow
def test_radii_that_are_not_found_may_be_with_another_groove() -> None:
    """Of some stretched designs a border vanishes with every second set of radii."""
    stretched = "n=9", "optics.stretch=[2, 2]"
    with pytest.raises(SpecError, match=r"change shell\.groove_mm, optics\.n"):
        modelled(*stretched, "groove_mm=0.05")
    assert heights(modelled(*stretched, "groove_mm=0.1")).min() > -1e-9


def test_every_mirror_covers_the_target_whatever_the_groove() -> None:
    areas = []
    for groove in (0.02, 0.1, 0.5):
        array = pedestal_design("n=4", f"shell.groove_mm={groove}").arrays[0]
        assert array.coverage.min() == pytest.approx(60.6, abs=1e-3)
        areas.append(array.area.sum())
    assert areas[0] > areas[1] > areas[2]
    assert 0.9 * mirror_array("n=4").area.sum() < areas[1] < mirror_array("n=4").area.sum()


def test_a_coat_leaves_the_pedestals_where_they_are() -> None:
    array = pedestal_design("n=4", "coating_um=100").arrays[0]
    bare, coated = array.modelled_cells, array.cells
    assert (cell_areas(bare) != cell_areas(coated)).all()
    walls = slice(bare.mirrors, None)
    np.testing.assert_array_equal(bare.surfaces.normal[walls], coated.surfaces.normal[walls])

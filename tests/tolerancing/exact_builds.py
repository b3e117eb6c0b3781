"""Builds by slow and independent means: cells of known topology, meshes, brute force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tbcad_verify.mesh.mesh import mesh_from_facets
from tbcad_verify.mesh.stl import parse
from tbcad_verify.record.export import Export
from tbcad_verify.record.files import read
from tbcad_verify.shell.optics import OpticalSetup, set_up
from tbcad_verify.shell.outline import minimum_miss_distance, reflect_on_fits, trace_outline
from tbcad_verify.shell.recover import recover

from tbcad.cad.formats.mesh_files import write_stl
from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.optics import windows
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.power_diagram import PLANES
from tbcad.core.optics.reflection import miss_distances, reflected_rays
from tbcad.core.optics.surfaces import Surfaces
from tbcad.shell.files import shell_envelope
from tbcad.shell.mesh import shell_mesh
from tbcad.tolerancing.montecarlo.draws import ShellDraws

FINE = 5  # rounds of refinement with which the slow tracing is good to 1e-8 mm


def made(array: MirrorArray, draws: ShellDraws, k: int) -> Cells:
    """Cells of build k before its shell is scaled and moved."""
    every, m = array.cells.surfaces, len(array)
    radius = 1 / every.curvature[:m] + draws.radius[k]
    centre = array.mirrors.centre + draws.centre[k]
    spheres = Surfaces(centre + radius[:, None] * every.normal[:m], every.normal[:m], 1 / radius)
    walls = every.subset(slice(m, m + PLANES))
    if isinstance(array.cells, PedestalCells):
        return array.cells.with_mirrors(spheres)
    return cells_of(spheres.joined(walls), array.cells.triangles)


def placed(cells: Cells, scale: float, middle: np.ndarray) -> Cells:
    """Cells scaled evenly, seen from an object's middle."""
    at = cells.surfaces
    surfaces = Surfaces(at.apex * scale - middle, at.normal, at.curvature / scale)
    moved = replace(cells, surfaces=surfaces, corners=cells.corners * scale - middle)
    if isinstance(moved, PedestalCells):
        points = moved.edges.points * scale - middle
        return replace(moved, edges=replace(moved.edges, points=points))
    return moved


def traced_coverage(array: MirrorArray, draws: ShellDraws, k: int) -> np.ndarray:
    """Coverage of each mirror of build k by tbcad.core.optics.windows, mm; of even scale only."""
    scale = draws.scale[k, 0]
    assert np.all(draws.scale[k] == scale)
    back = Rotation.from_rotvec(draws.shell_tilt[k]).inv()
    pinhole = back.apply(array.camera.pinhole + draws.camera_shift[k] - draws.shell_shift[k])
    middle = back.apply(-draws.shell_shift[k])
    cells = made(array, draws, k)
    whole = array.cells.surfaces.apex[:, 0] != 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(windows, "ROUNDS", FINE)
        patch.setattr(windows, "limiting_sides", lambda one: _counted(one, whole))
        return windows.coverage_diameters(placed(cells, scale, middle), pinhole - middle)


def _counted(cells: Cells, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What core.optics.windows.limiting_sides does, with the halved mirrors known beforehand."""
    faces = cells.arcs.faces
    arc, which = np.nonzero(faces < cells.mirrors)
    mirror, other = faces[arc, which], faces[arc, 1 - which]
    counted = whole[mirror] | (other != cells.seam)
    return mirror[counted], arc[counted]


def write_meshes(
    design: MirrorDesign, draws: tuple[ShellDraws, ShellDraws], k: int, folder: Path
) -> None:
    """Write both shells of build k as STL files, as the exporter would."""
    first, body = design.arrays[0], shell_envelope(design)
    for array, drawn in zip(design.arrays, draws, strict=True):
        own = made(array, drawn, k)
        facets = shell_mesh(
            design.spec, own if array is first else own.mirrored(), body, first.apex_distance
        )
        facets = facets if array is first else facets.mirrored()
        turn = Rotation.from_rotvec(drawn.shell_tilt[k])
        points = turn.apply(facets.vertices * drawn.scale[k]) + drawn.shell_shift[k]
        write_stl(folder / f"shell_{array.camera_id}.stl", Mesh(points, facets.triangles))


def verified_coverage(record: Export, shifts: Mapping[str, np.ndarray]) -> np.ndarray:
    """Coverage of every virtual camera by the verification's own reading of STL files, mm, (v,)."""
    cameras = {
        name: camera.model_copy(update={"pinhole": camera.pinhole + shifts[name]})
        for name, camera in record.cameras.items()
    }
    record = replace(record, cameras=cameras)
    meshes = [mesh_from_facets(parse(read(record.folder, part.stl))) for part in record.parts]
    found = [
        recover(one, cameras[part.camera].pinhole, record.target_mm / 2)
        for one, part in zip(meshes, record.parts, strict=True)
    ]
    return _minimum_coverage(set_up(record, meshes, found))


def _minimum_coverage(setup: OpticalSetup) -> np.ndarray:
    """Minimum coverage by tbcad_verify.shell.coverage, without the check of the seam gaps."""
    virtual, owner, coat = setup.virtual, setup.owner(), setup.export.coating_mm
    outlines = [
        trace_outline(setup.mesh, setup.recovery, owner, coat, setup.mine(camera), virtual.halved)
        for camera in setup.cameras
    ]
    lines = [
        reflect_on_fits(outline, setup.seen(camera))
        for outline, camera in zip(outlines, setup.cameras, strict=True)
    ]
    assert (setup.match.segment >= 0).all()
    pairs = zip(outlines, lines, strict=True)
    return 2 * np.min([minimum_miss_distance(o, at, virtual) for o, at in pairs], axis=0)


def bisected_coverage(
    array: MirrorArray, draws: ShellDraws, k: int, mirror: int, ways: int = 4_000
) -> float:
    """Coverage of a mirror of build k by bisection of where each way from its apex ends, mm.

    Every sphere and plane is looked at, scaled as it is, without any circle or corner.
    """
    every, m = array.cells.surfaces, len(array)
    scale = draws.scale[k]
    centre = array.mirrors.centre + draws.centre[k]
    radius = array.mirrors.radius + draws.radius[k]
    apart = np.linalg.norm(array.mirrors.apex - array.mirrors.apex[mirror], axis=1)
    others = np.argsort(apart)[1:26]
    axis = np.eye(3) - np.outer(every.normal[mirror], every.normal[mirror])
    first = axis[np.argmax(np.linalg.norm(axis, axis=1))]
    first = first / np.linalg.norm(first)
    turn = np.linspace(0, 2 * np.pi, ways, endpoint=False)[:, None]
    way = np.cos(turn) * first + np.sin(turn) * np.cross(every.normal[mirror], first)

    def at(angle: np.ndarray) -> np.ndarray:
        out = np.cos(angle)[:, None] * every.normal[mirror] + np.sin(angle)[:, None] * way
        return scale * (centre[mirror] + radius[mirror] * out)

    def inside(x: np.ndarray) -> np.ndarray:
        away = x[:, None] / scale - centre[others]
        clear = (np.linalg.norm(away, axis=2) >= radius[others]).all(axis=1)
        for wall in (m, m + 1):
            clear &= (x / scale - every.apex[wall]) @ every.normal[wall] >= 0
        return clear

    low, high = np.zeros(ways), np.full(ways, np.pi / 2)
    high[:] = np.minimum(high, 60 / radius[mirror])
    assert inside(at(low)).all()
    assert not inside(at(high)).any()
    for _ in range(40):
        middle = (low + high) / 2
        kept = inside(at(middle))
        low, high = np.where(kept, middle, low), np.where(kept, high, middle)
    point = at(low)
    normal = (point / scale - centre[mirror]) / scale
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return float(2 * miss_distances(array.camera.pinhole, point, normal).min())


def surrounded(array: MirrorArray, shift: np.ndarray) -> np.ndarray:
    """Whether each whole mirror's rays go round the object's middle, the camera moved, (m,).

    By the angle that the outline's image turns about the middle, along finely sampled arcs.
    """
    cells, pinhole = array.cells, array.camera.pinhole + shift
    offsets, sides = cells.rings
    mirror = np.repeat(np.arange(cells.mirrors), np.diff(offsets))
    t = np.broadcast_to(np.linspace(0, 1, 65), (len(sides), 65))
    t = np.where((sides % 2 == 1)[:, None], 1 - t, t)
    point = cells.arcs.at(np.broadcast_to((sides // 2)[:, None], t.shape), t)
    face = np.broadcast_to(mirror[:, None], t.shape)
    out = reflected_rays(pinhole, point, cells.surfaces.gradient(face, point))
    u = array.u[mirror][:, None]
    image = point - out * ((point * u).sum(axis=2) / (out * u).sum(axis=2))[..., None]
    first = np.cross(array.u, [0.3, 0.5, 0.8])
    second = np.cross(array.u, first)
    angle = np.arctan2(
        np.einsum("stx,sx->st", image, second[mirror]),
        np.einsum("stx,sx->st", image, first[mirror]),
    )
    turned = np.diff(np.unwrap(angle, axis=1)[:, [0, -1]], axis=1)[:, 0]
    return np.abs(np.bincount(mirror, turned)) > np.pi

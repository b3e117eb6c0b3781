"""All files of both shells and of their negatives, from a design to a folder."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from OCP.TopoDS import TopoDS_Face

from tbcad.cad.formats.mesh_files import write_3mf, write_stl
from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Maker, Ring, Solid, hole_faces
from tbcad.cad.kernel.checks import (
    SolidProperties,
    face_integrals,
    mean_corner,
    properties,
    properties_within,
)
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.solids import faces, reversed_faces
from tbcad.common.reuse import kept
from tbcad.core.geometry.vectors import FLIP_X
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.mirrors.record import part_files
from tbcad.core.optics.cells import Cells, cell_integrals
from tbcad.core.optics.pedestals.cells import PedestalCells, wall_integrals
from tbcad.records.design import MandrelRecord
from tbcad.shell.envelope import Envelope, Holes, boundary_chain, chain_ends
from tbcad.shell.halves import camera_a_mandrel_mesh, camera_a_mesh, design_mandrel, shell_envelope
from tbcad.shell.mandrel import Mandrel
from tbcad.shell.solid import FrontEdges, casing_faces, front_edges, reversed_ring
from tbcad.types import Floats, Progress

X, Y, Z = np.eye(3)
DRAFT_DIGITS = 6
NamedFaces: TypeAlias = list[tuple[str, TopoDS_Face]]


@kept("shells")
def write_shell_meshes(design: MirrorDesign, envelope: Envelope, folder: Path) -> None:
    """Write both shells as STL and 3MF into a folder; the envelope closes camera a's half."""
    mesh = camera_a_mesh(design, envelope)
    for array in design.arrays:
        write_half_mesh(folder, part_files("shell", array), mesh, array)


def write_half_mesh(folder: Path, files: dict[str, str], mesh: Mesh, array: MirrorArray) -> None:
    """Write one camera's half as STL and 3MF, given camera a's mesh and the files' names."""
    own_mesh = mesh.mirrored() if array.camera_id == "b" else mesh
    write_stl(folder / files["stl"], own_mesh)
    write_3mf(folder / files["3mf"], files["name"], own_mesh)


@kept("shells", heard=True)
def write_shell_solids(
    design: MirrorDesign, envelope: Envelope, folder: Path, progress: Progress = lambda _: None
) -> None:
    """Write both shells as STEP; the envelope closes camera a's half.

    Whether the kernel finds them valid, the verification asks of what it reads.
    """
    # The kernel integrates a back to some 1e-6 only, and alike in its mirror image only where the
    # design is symmetrical about y = 0.
    known, symmetric = None, design.spec.optics.camera_mm[1] == 0
    for array in design.arrays:
        files = part_files("shell", array)
        progress(f"{files['name']}: solid")
        solid = camera_solid(design, array, envelope)
        progress(f"{files['name']}: files")
        known = known.mirrored() if known and symmetric else shell_properties(solid, array)
        write_step(folder / files["step"], solid, design.spec.step.pcurves, known)


def camera_solid(
    design: MirrorDesign, array: MirrorArray, envelope: Envelope | None = None
) -> Solid:
    """Solid of one camera's half, face by face; without an envelope it is worked out.

    SpecError if flanges or holes do not fit. Nothing asks the kernel whether it is valid.
    """
    closing = envelope or shell_envelope(design)
    return _half_solid("shell", design, array, lambda front: casing_faces(front, closing))


def _half_solid(
    kind: Literal["shell", "mandrel"],
    design: MirrorDesign,
    array: MirrorArray,
    closing: Callable[[FrontEdges], NamedFaces],
) -> Solid:
    """Mirrors and walls, a mandrel's from behind, and the faces that close them."""
    name, maker = part_files(kind, array)["name"], Maker(mirrored=array.camera_id == "b")
    cells = design.arrays[0].modelled_cells  # the maker mirrors them for camera b
    front = front_edges(maker, cells)
    own, closed = [*front.faces(), *front.walls()], closing(front)
    names = [*array.ids, *wall_names(array.ids, cells)]
    named = zip(names, own if kind == "shell" else reversed_faces(own), strict=True)
    faces = [*named, *closed]
    return Solid(name, maker.solid([face for _, face in faces]), tuple(faces))


def wall_names(ids: Sequence[str], cells: Cells) -> list[str]:
    """Names of the pedestals' walls: that of a0001 toward a0002 is a0001_a0002."""
    if not isinstance(cells, PedestalCells):
        return []
    return [f"{ids[mirror]}_{ids[across]}" for mirror, across in cells.walls.tolist()]


def shell_properties(
    solid: Solid, array: MirrorArray, *, negative: bool = False
) -> SolidProperties:
    """Volume, area and centroid of a camera's half, or of its negative.

    Mirrors that are spheres are integrated along their arcs, and so are walls of pedestals: the
    kernel takes seconds for them.
    """
    cells = array.modelled_cells
    if not (cells.mirror_surfaces.curvature > 0).all():
        return properties(solid.shape)
    origin = mean_corner(solid.shape)
    total = cell_integrals(cells, origin)
    if isinstance(cells, PedestalCells):
        total += wall_integrals(cells, origin)
    if negative:  # the material is on their other side
        total = replace(total, volume=-total.volume, volume_moment=-total.volume_moment)
    for face in faces(solid.shape)[len(array) + len(wall_names(array.ids, cells)) :]:
        total += face_integrals(face, origin)
    return properties_within(total)


def closing_faces(front: FrontEdges, mandrel: Mandrel) -> NamedFaces:
    """Names and faces of everything but the mirrors and the walls of their pedestals."""
    maker, cells = front.maker, front.cells
    low, high = chain_ends(cells, boundary_chain(cells, cells.seam))
    ends = cells.corners[low], cells.corners[high], front.vertices[low], front.vertices[high]
    back = (maker.line(*ends), False)
    seam = [*front.chain(cells.seam), back]
    foot = reversed_ring([*front.chain(cells.foot), back])
    base = mandrel.foot * Z
    return [
        *_plane_with_holes(front, "seam", 0 * X, seam, mandrel.seam_holes, (Y, Z)),
        *_plane_with_holes(front, "foot", base, foot, mandrel.foot_holes, (X, Y)),
    ]


def _plane_with_holes(
    front: FrontEdges,
    name: str,
    point: Floats,
    ring: Ring,
    holes: Holes,
    axes: tuple[Floats, Floats],
) -> NamedFaces:
    """A joining plane, which looks against the holes' direction, their walls and bottoms."""
    maker, outward = front.maker, -np.cross(*axes)
    near, far, walls = hole_faces(maker, *holes.sizes, *axes)
    bottoms = [
        maker.face(maker.plane(centre + holes.direction, outward), [rim], natural=True)
        for centre, rim in zip(holes.centre, far, strict=True)
    ]
    plane = maker.face(maker.plane(point, outward), [ring, *near], natural=True)
    inner = (
        ((f"{name}_hole_{k:02d}", wall), (f"{name}_bottom_{k:02d}", bottom))
        for k, (wall, bottom) in enumerate(zip(walls, bottoms, strict=True), start=1)
    )
    return [(name, plane), *chain.from_iterable(inner)]


@kept("mandrels")
def write_mandrels(design: MirrorDesign, mandrel: Mandrel, folder: Path) -> None:
    """Write both negatives, the mandrel being a's, as STEP, STL and 3MF."""
    mesh = camera_a_mandrel_mesh(design, mandrel)
    for array in design.arrays:
        files = part_files("mandrel", array)
        write_half_mesh(folder, files, mesh, array)
        solid = mandrel_solid(design, array, mandrel)
        known = shell_properties(solid, array, negative=True)
        write_step(folder / files["step"], solid, design.spec.step.pcurves, known)


def mandrel_solid(
    design: MirrorDesign, array: MirrorArray, mandrel: Mandrel | None = None
) -> Solid:
    """Solid of one camera's negative, face by face; errors and the mandrel as of `camera_solid`."""
    closing = mandrel or design_mandrel(design)
    return _half_solid("mandrel", design, array, lambda front: closing_faces(front, closing))


def mandrel_record(array: MirrorArray, mandrel: Mandrel) -> MandrelRecord:
    """What design.json says of one negative: its files, and how the shell comes off."""
    draft = mandrel.draft
    pull = draft.pull * FLIP_X if array.camera_id == "b" else draft.pull
    degrees = round(float(np.degrees(draft.angle)), DRAFT_DIGITS)
    return MandrelRecord(
        **part_files("mandrel", array), pull=(pull + 0.0).tolist(), draft_deg=degrees
    )

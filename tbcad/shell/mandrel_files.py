"""All files of both negatives, and what design.json says of them."""

from itertools import chain
from pathlib import Path

import numpy as np
from OCP.TopoDS import TopoDS_Face

from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Maker, Ring, Solid, hole_faces
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.solids import one_solid, reversed_faces
from tbcad.core.geometry.vectors import FLIP_X
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.mirrors.record import mandrel_files
from tbcad.core.optics.cells import Cells
from tbcad.core.spec.design import Spec
from tbcad.records.design import MandrelRecord
from tbcad.shell.casing_edges import boundary_chain, chain_ends
from tbcad.shell.envelope import Holes
from tbcad.shell.files import shell_properties, wall_names, write_half_mesh
from tbcad.shell.mandrel import Mandrel, mandrel_of
from tbcad.shell.mesh import FROM_X, FROM_Z, MeshBuilder, front_facets
from tbcad.shell.solid import FrontEdges, front_edges, reversed_ring
from tbcad.types import Floats, Ints

X, Y, Z = np.eye(3)
DRAFT_DIGITS = 6


def mandrel_mesh(spec: Spec, cells: Cells, mandrel: Mandrel, distance: Floats) -> Mesh:
    """Mesh of the negative of camera a's half; its mirrors' facets are those of `shell_mesh`."""
    builder, outlines = front_facets(spec, cells, distance)
    builder.triangles = [triangles[:, ::-1] for triangles in builder.triangles]
    seam, foot = (
        outlines.along(boundary_chain(cells, plane)) for plane in (cells.seam, cells.foot)
    )
    # Low y to high y: over the top from +x that turns right, round the front from +z left.
    _meshed_plane(builder, seam[::-1], mandrel.seam_holes, np.stack([Y, Z]), FROM_X)
    _meshed_plane(builder, foot, mandrel.foot_holes, np.stack([X, Y]), FROM_Z)
    return builder.mesh()


def _meshed_plane(
    builder: MeshBuilder, ring: Ints, holes: Holes, axes: Floats, view: list[int]
) -> None:
    near, far = builder.holes(holes, axes)
    builder.plane(view, ring, near, away=True)
    for rim in far:
        builder.plane(view, rim[::-1], [], away=True)


def closing_faces(front: FrontEdges, mandrel: Mandrel) -> list[tuple[str, TopoDS_Face]]:
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
) -> list[tuple[str, TopoDS_Face]]:
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


def design_mandrel(design: MirrorDesign) -> Mandrel:
    """What closes camera a's mirrors to a negative; SpecError if there is no room for its holes."""
    array = design.arrays[0]
    return mandrel_of(design.spec.shell, array.modelled_cells, array.ellipsoid)


def write_mandrels(design: MirrorDesign, mandrel: Mandrel, folder: Path) -> None:
    """Write both negatives as STEP, STL and 3MF into a folder; the mandrel is camera a's.

    InvalidSolidError if the kernel finds a solid invalid.
    """
    mesh = camera_a_mandrel_mesh(design, mandrel)
    for array in design.arrays:
        files = mandrel_files(array)
        write_half_mesh(folder, files, mesh, array)
        solid = mandrel_solid(design, array, mandrel)
        known = shell_properties(solid, array, negative=True)
        write_step(folder / files["step"], solid, design.spec.step.pcurves, known)


def mandrel_solid(
    design: MirrorDesign, array: MirrorArray, mandrel: Mandrel | None = None
) -> Solid:
    """Solid of one camera's negative, face by face; without a mandrel it is worked out.

    Errors are those of `camera_solid`.
    """
    name, maker = mandrel_files(array)["name"], Maker(mirrored=array.camera_id == "b")
    cells = design.arrays[0].modelled_cells  # the maker mirrors them for camera b
    front = front_edges(maker, cells)
    closing = closing_faces(front, mandrel or design_mandrel(design))
    names = [*array.ids, *wall_names(array.ids, cells)]
    mirrors_and_walls = reversed_faces([*front.faces(), *front.walls()])
    faces = [*zip(names, mirrors_and_walls, strict=True), *closing]
    solid = maker.solid([face for _, face in faces])
    return Solid(name, solid if maker.mirrored else one_solid(name, solid), tuple(faces))


def camera_a_mandrel_mesh(design: MirrorDesign, mandrel: Mandrel | None = None) -> Mesh:
    """Mesh of camera a's negative; the mandrel is worked out (or SpecError) where not given."""
    array = design.arrays[0]
    mandrel = mandrel or design_mandrel(design)
    return mandrel_mesh(design.spec, array.modelled_cells, mandrel, array.apex_distance)


def mandrel_record(array: MirrorArray, mandrel: Mandrel) -> MandrelRecord:
    """What design.json says of one negative: its files, and how the shell comes off."""
    draft = mandrel.draft
    pull = draft.pull * FLIP_X if array.camera_id == "b" else draft.pull
    degrees = round(float(np.degrees(draft.angle)), DRAFT_DIGITS)
    return MandrelRecord(**mandrel_files(array), pull=(pull + 0.0).tolist(), draft_deg=degrees)

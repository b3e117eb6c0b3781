"""All files of both negatives, and what design.json says of them."""

from pathlib import Path

import numpy as np

from tbcad.cad.brep import Maker, Solid
from tbcad.cad.mesh import Mesh
from tbcad.cad.solids import one_solid, reversed_faces
from tbcad.formats.step import write_step
from tbcad.geometry.vectors import FLIP_X
from tbcad.mirrors.array import MirrorArray, MirrorDesign
from tbcad.mirrors.record import mandrel_files
from tbcad.records.design import MandrelRecord
from tbcad.shell.files import shell_properties, wall_names, write_half_mesh
from tbcad.shell.front import front_edges
from tbcad.shell.mandrel import Mandrel, mandrel_of
from tbcad.shell.mandrel_mesh import mandrel_mesh
from tbcad.shell.mandrel_solid import closing_faces

DRAFT_DIGITS = 6


def design_mandrel(design: MirrorDesign) -> Mandrel:
    """What closes camera a's mirrors to a negative.

    Raises:
        SpecError: when there is no room for its holes.
    """
    array = design.arrays[0]
    return mandrel_of(design.spec.shell, array.modelled_cells, array.ellipsoid)


def write_mandrels(design: MirrorDesign, mandrel: Mandrel, folder: Path) -> None:
    """Write both negatives as STEP, STL and 3MF into a folder.

    Args:
        design: the mirrors.
        mandrel: of camera a.
        folder: to write into.

    Raises:
        InvalidSolidError: when the kernel finds a solid invalid.
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

    Raises:
        SpecError: when there is no room for its holes.
        InvalidSolidError: when the kernel finds camera a's invalid; b's is its mirror image.
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
    """Mesh of camera a's negative; the mandrel is worked out when it is not given.

    Raises:
        SpecError: when there is no room for its holes.
    """
    array = design.arrays[0]
    mandrel = mandrel or design_mandrel(design)
    return mandrel_mesh(design.spec, array.modelled_cells, mandrel, array.apex_distance)


def mandrel_record(array: MirrorArray, mandrel: Mandrel) -> MandrelRecord:
    """What design.json says of one negative: its files, and how the shell comes off."""
    draft = mandrel.draft
    pull = draft.pull * FLIP_X if array.camera_id == "b" else draft.pull
    degrees = round(float(np.degrees(draft.angle)), DRAFT_DIGITS)
    return MandrelRecord(**mandrel_files(array), pull=(pull + 0.0).tolist(), draft_deg=degrees)

"""All files of both shells, from a design to a folder."""

from collections.abc import Sequence
from pathlib import Path

from tbcad.cad.formats.step import write_step
from tbcad.cad.formats.step_mirror import mirrored_step
from tbcad.cad.formats.stl import write_stl
from tbcad.cad.formats.threemf import write_3mf
from tbcad.cad.kernel.brep import Maker, Solid
from tbcad.cad.kernel.measures import (
    FaceIntegrals,
    SolidProperties,
    face_integrals,
    mean_corner,
    properties,
)
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.solids import faces, one_solid
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.mirrors.record import shell_record
from tbcad.core.optics.cell_moments import cell_moments
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.pedestals.walls import wall_moments
from tbcad.shell.envelope import Envelope, closing_envelope
from tbcad.shell.mesh import shell_mesh
from tbcad.shell.solid import casing_faces, front_edges
from tbcad.types import Progress


def write_shell_meshes(design: MirrorDesign, envelope: Envelope, folder: Path) -> None:
    """Write both shells as STL and 3MF into a folder; the envelope closes camera a's half."""
    mesh = camera_a_mesh(design, envelope)
    for array in design.arrays:
        write_half_mesh(folder, shell_record(array), mesh, array)


def write_half_mesh(folder: Path, files: dict[str, str], mesh: Mesh, array: MirrorArray) -> None:
    """Write one camera's half as STL and 3MF, given camera a's mesh and the files' names."""
    own_mesh = mesh.mirrored() if array.camera_id == "b" else mesh
    write_stl(folder / files["stl"], own_mesh)
    write_3mf(folder / files["3mf"], files["name"], own_mesh)


def write_shell_solids(
    design: MirrorDesign, envelope: Envelope, folder: Path, progress: Progress = lambda _: None
) -> None:
    """Write both shells as STEP into a folder; the envelope closes camera a's half.

    InvalidSolidError if the kernel finds a solid invalid.
    """
    # The kernel integrates a back to some 1e-6 only, and alike in its mirror image only where the
    # design is symmetrical about y = 0.
    known, symmetric = None, design.spec.optics.camera_mm[1] == 0
    for array in design.arrays:
        files = shell_record(array)
        if known and symmetric and not design.spec.step.pcurves:
            progress(f"{files['name']}: files")
            _write_mirrored(folder, design.arrays[0], array)
            continue
        progress(f"{files['name']}: solid")
        solid = camera_solid(design, array, envelope)
        progress(f"{files['name']}: files")
        known = known.mirrored() if known and symmetric else shell_properties(solid, array)
        write_step(folder / files["step"], solid, design.spec.step.pcurves, known)


def _write_mirrored(folder: Path, original: MirrorArray, array: MirrorArray) -> None:
    """Write the STEP file of camera b's half as the mirror image of that of camera a's.

    Readers find in both the same figures to the last digit, which the kernel's own file of the
    mirrored solid would not give: it cuts numbers that are long, and a minus sign is a character.
    """
    one, other = shell_record(original), shell_record(array)
    names = [wall_names(some.ids, original.modelled_cells) for some in (original, array)]
    renamed = {one["name"]: other["name"], **dict(zip(original.ids, array.ids, strict=True))}
    renamed |= dict(zip(*names, strict=True))
    text = (folder / one["step"]).read_bytes().decode("ascii")
    (folder / other["step"]).write_bytes(mirrored_step(text, renamed).encode("ascii"))


def shell_envelope(design: MirrorDesign) -> Envelope:
    """What closes camera a's half: back, flanges, holes; SpecError where these do not fit."""
    array = design.arrays[0]
    return closing_envelope(design.spec.shell, array.modelled_cells, array.ellipsoid)


def camera_solid(
    design: MirrorDesign, array: MirrorArray, envelope: Envelope | None = None
) -> Solid:
    """Solid of one camera's half, face by face; without an envelope it is worked out.

    SpecError if flanges or holes do not fit, InvalidSolidError if the kernel finds camera a's
    invalid; b's is its mirror image.
    """
    name, maker = shell_record(array)["name"], Maker(mirrored=array.camera_id == "b")
    cells = design.arrays[0].modelled_cells  # the maker mirrors them for camera b
    mirrors = front_edges(maker, cells)
    casing = casing_faces(mirrors, envelope or shell_envelope(design))
    walls = zip(wall_names(array.ids, cells), mirrors.walls(), strict=True)
    faces = [*zip(array.ids, mirrors.faces(), strict=True), *walls, *casing]
    solid = maker.solid([face for _, face in faces])
    # The kernel's check would find of the mirror image what it found of camera a's half.
    return Solid(name, solid if maker.mirrored else one_solid(name, solid), tuple(faces))


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
    mirrors = cell_moments(cells, origin)
    side = -1.0 if negative else 1.0  # of the material
    area = float(mirrors.area.sum())
    total = FaceIntegrals(origin, side * mirrors.volume, side * mirrors.volume_moment, area)
    if isinstance(cells, PedestalCells):
        walls = wall_moments(cells, origin)
        area = float(walls.area.sum())
        total += FaceIntegrals(origin, side * walls.volume, side * walls.volume_moment, area)
    for face in faces(solid.shape)[len(array) + len(wall_names(array.ids, cells)) :]:
        total += face_integrals(face, origin)
    return total.properties


def camera_a_mesh(design: MirrorDesign, envelope: Envelope | None = None) -> Mesh:
    """Mesh of camera a's half; the envelope is worked out (or SpecError) where it is not given."""
    array = design.arrays[0]
    envelope = envelope or shell_envelope(design)
    return shell_mesh(design.spec, array.modelled_cells, envelope, array.apex_distance)

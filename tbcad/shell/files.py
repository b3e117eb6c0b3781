"""All files of both shells, from a design to a folder."""

from pathlib import Path

import numpy as np

from tbcad.cad.brep import Solid
from tbcad.cad.mesh import Mesh
from tbcad.formats.step import write_step
from tbcad.formats.stl import write_stl
from tbcad.formats.threemf import write_3mf
from tbcad.mirrors.array import MirrorArray, MirrorDesign
from tbcad.mirrors.record import part
from tbcad.shell.envelope import Envelope, envelope
from tbcad.shell.mesh import shell_mesh
from tbcad.shell.solid import shell_solid
from tbcad.types import Progress


def write_shells(design: MirrorDesign, folder: Path, progress: Progress = lambda _: None) -> None:
    """Write both shells as STEP, STL and 3MF into a folder.

    Raises:
        SpecError: when flanges or holes do not fit.
        InvalidSolidError: when the kernel finds a solid invalid.
    """
    first = design.halves[0]
    around = shell_envelope(design)
    progress("facets")
    facets = shell_mesh(design.spec, first.modelled_cells, around, object_distances(first))
    for half in design.halves:
        _export(design, half, around, facets, folder, progress)


def camera_solid(design: MirrorDesign, half: MirrorArray, around: Envelope | None = None) -> Solid:
    """Solid of one camera's half; the envelope is worked out when it is not given.

    Raises:
        SpecError: when flanges or holes do not fit.
        InvalidSolidError: when the kernel finds the solid invalid.
    """
    name, modelled = part(half)["name"], design.halves[0].modelled_cells
    closing = around or shell_envelope(design)
    return shell_solid(name, half.ids, modelled, closing, mirrored=half.camera_id == "b")


def shell_envelope(design: MirrorDesign) -> Envelope:
    """What closes camera a's half: back, flanges, holes.

    Raises:
        SpecError: when flanges or holes do not fit.
    """
    first = design.halves[0]
    return envelope(design.spec.shell, first.modelled_cells, first.ellipsoid)


def object_distances(half: MirrorArray) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Distance of each mirror from the object, mm, (m,)."""
    return half.ellipsoid.radial_distance(half.u)


def _export(
    design: MirrorDesign,
    half: MirrorArray,
    closing: Envelope,
    facets: Mesh,
    folder: Path,
    progress: Progress,
) -> None:
    """Write one half; closing and facets are camera a's."""
    files = part(half)
    progress(f"{files['name']}: solid")
    own = facets.mirrored() if half.camera_id == "b" else facets
    solid = camera_solid(design, half, closing)
    progress(f"{files['name']}: files")
    write_step(folder / files["step"], solid, design.spec.step.pcurves)
    write_stl(folder / files["stl"], own)
    write_3mf(folder / files["3mf"], files["name"], own)

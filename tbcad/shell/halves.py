"""Meshes of both shells and of their negatives, and what closes them: without the CAD kernel."""

import numpy as np

from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.shell.envelope import Envelope, Holes, boundary_chain, closing_envelope
from tbcad.shell.facets import check_facets
from tbcad.shell.mandrel import Mandrel, mandrel_of
from tbcad.shell.mesh import FROM_X, FROM_Z, MeshBuilder, front_facets, shell_mesh
from tbcad.types import Floats, Ints

X, Y, Z = np.eye(3)


def shell_envelope(design: MirrorDesign) -> Envelope:
    """What closes camera a's half: back, flanges, holes; SpecError where these do not fit."""
    array = design.arrays[0]
    return closing_envelope(design.spec.shell, array.modelled_cells, array.ellipsoid)


def design_mandrel(design: MirrorDesign) -> Mandrel:
    """What closes camera a's mirrors to a negative; SpecError if there is no room for its holes."""
    array = design.arrays[0]
    return mandrel_of(design.spec.shell, array.modelled_cells, array.ellipsoid)


def check_mirrors(design: MirrorDesign) -> None:
    """SpecError where the mirrors' facets would fold, or show less than the capture sphere."""
    array = design.arrays[0]
    check_facets(design.spec, array.modelled_cells, array.apex_distance)


def camera_a_mesh(design: MirrorDesign, envelope: Envelope | None = None) -> Mesh:
    """Mesh of camera a's half; the envelope is worked out (or SpecError) where it is not given."""
    array = design.arrays[0]
    envelope = envelope or shell_envelope(design)
    return shell_mesh(design.spec, array.modelled_cells, envelope, array.apex_distance)


def camera_a_mandrel_mesh(design: MirrorDesign, mandrel: Mandrel | None = None) -> Mesh:
    """Mesh of camera a's negative, whose mirrors have the facets of `shell_mesh`.

    The mandrel is worked out (or SpecError) where it is not given.
    """
    cells, mandrel = design.arrays[0].modelled_cells, mandrel or design_mandrel(design)
    builder, outlines = front_facets(design.spec, cells, design.arrays[0].apex_distance)
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

"""Triangles of the negative: the shell's front facets turned about, two planes, and blind holes."""

import numpy as np

from tbcad.cad.mesh import Mesh
from tbcad.optics.cells import Cells
from tbcad.shell.boundary import boundary_chain
from tbcad.shell.envelope import Holes
from tbcad.shell.mandrel import Mandrel
from tbcad.shell.mesh import FROM_X, FROM_Z, MeshBuilder, front_facets
from tbcad.spec.design import Spec
from tbcad.types import Floats, Ints

X, Y, Z = np.eye(3)


def mandrel_mesh(spec: Spec, cells: Cells, mandrel: Mandrel, distance: Floats) -> Mesh:
    """Mesh of the negative of camera a's half; its mirrors' facets are those of `shell_mesh`.

    Args:
        spec: design with the mesh tolerances.
        cells: camera a's cells of the modelled surfaces.
        mandrel: what closes them.
        distance: from each mirror to the object, mm, (m,).
    """
    builder, outlines = front_facets(spec, cells, distance)
    builder.triangles = [triangles[:, ::-1] for triangles in builder.triangles]
    seam, foot = (
        outlines.along(boundary_chain(cells, plane)) for plane in (cells.seam, cells.foot)
    )
    # Low y to high y: over the top from +x that turns right, round the front from +z left.
    _plane_with_holes(builder, seam[::-1], mandrel.seam_holes, np.stack([Y, Z]), FROM_X)
    _plane_with_holes(builder, foot, mandrel.foot_holes, np.stack([X, Y]), FROM_Z)
    return builder.mesh()


def _plane_with_holes(
    builder: MeshBuilder, ring: Ints, holes: Holes, axes: Floats, view: list[int]
) -> None:
    near, far = builder.holes(holes, axes)
    builder.plane(view, ring, near, away=True)
    for rim in far:
        builder.plane(view, rim[::-1], [], away=True)

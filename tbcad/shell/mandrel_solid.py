"""Faces of the negative: the shell's mirrors turned about, two planes, and blind holes."""

from itertools import chain

import numpy as np
from OCP.TopoDS import TopoDS_Face

from tbcad.cad.bores import hole_faces
from tbcad.cad.brep import Ring
from tbcad.shell.boundary import boundary_chain, chain_ends
from tbcad.shell.casing import reversed_ring
from tbcad.shell.envelope import Holes
from tbcad.shell.front import FrontEdges
from tbcad.shell.mandrel import Mandrel
from tbcad.types import Floats

X, Y, Z = np.eye(3)


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

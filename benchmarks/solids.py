"""Solids in closed form against booleans of the same spheres, by manifold3d and by the kernel."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import manifold3d
import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
from OCP.gp import gp_Pnt
from OCP.TopTools import TopTools_ListOfShape
from timing import Figure, Row, at_most, in_turns, measured

from tbcad.cad.kernel.brep import Solid
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design, numbered_directions
from tbcad.core.optics.cells import cells_of
from tbcad.core.optics.power_diagram import bounded_triangulation
from tbcad.core.spec.load import load_spec
from tbcad.shell.files import camera_solid
from tbcad.shell.halves import shell_envelope

SEGMENTS = 64
FUSED = (8, 16)


def solids(rounds: int) -> list[Row]:
    """Both shells, checked by the kernel, against unions of one half's spheres."""
    made = design(load_spec(None, ["optics.n=18"]))
    array = made.arrays[0]
    meshed = meshed_spheres(array)
    exact = {count: exact_spheres(array, count) for count in FUSED}
    fuses = [partial(fused, exact[count]) for count in FUSED]
    works = [partial(shells, made), partial(united, meshed), *fuses]
    ours, union, *kernel = in_turns(works, rounds)
    return [
        measured("cells, both solids, kernel's check", ours, "s"),
        measured(f"manifold3d's union, {len(array)} spheres of one shell", union, "s"),
        measured("cells, both solids, check to manifold3d", ours.over(union), "times"),
        # Load by others slows manifold3d, on two cores, more than us on one: least is fairest.
        at_most("- least of each", Figure((ours.minimum / union.minimum,)), 0.75, "times"),
        *(
            measured(f"the kernel's union, {count} of the spheres", figure, "s")
            for count, figure in zip(FUSED, kernel, strict=True)
        ),
    ]


def radii(rounds: int) -> list[Row]:
    """The mirrors with exact radii, from the spec."""
    specs = {n: load_spec(None, [f"optics.n={n}"]) for n in (18, 36, 60)}
    small, *large = in_turns([partial(design, spec) for spec in specs.values()], rounds)
    return [
        at_most("radius solve, n = 18", small, 2, "s"),
        *(
            measured(f"radius solve, n = {n}", figure, "s")
            for n, figure in zip((36, 60), large, strict=True)
        ),
    ]


def shells(made: MirrorDesign) -> list[Solid]:
    """Cells and both solids with the kernel's check, given the radii: what no boolean does here.

    The cells start from the polyhedron, not from those that the radii were solved with.
    """
    array = made.arrays[0]
    every, faces = numbered_directions(made.spec.optics.n)
    upper = (every[:, 0] >= 0) & (every[:, 2] >= 0)
    triangles = bounded_triangulation(faces, every, upper)
    first = replace(array, modelled_cells=cells_of(array.modelled_cells.surfaces, triangles))
    design = replace(made, arrays=(first, made.arrays[1]))
    envelope = shell_envelope(design)
    return [camera_solid(design, one, envelope) for one in design.arrays]


def spheres(array: MirrorArray) -> list[tuple[list[float], float]]:
    """Centres and radii of one half's mirrors."""
    mirrors = array.mirrors
    centres = mirrors.apex - mirrors.radius[:, None] * mirrors.normal
    return list(zip(centres.tolist(), mirrors.radius.tolist(), strict=True))


def meshed_spheres(array: MirrorArray) -> list[manifold3d.Manifold]:
    """All of one half's spheres as meshes, made beforehand: only the union is on the clock."""
    made = [
        manifold3d.Manifold.sphere(radius, SEGMENTS).translate(centre)
        for centre, radius in spheres(array)
    ]
    for one in made:
        one.num_tri()  # made only when asked for something
    return made


def united(parts: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    """Union; the question at the end makes manifold3d compute it."""
    whole = manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)
    if whole.is_empty():
        raise RuntimeError("manifold3d's union is empty")
    return whole


def exact_spheres(array: MirrorArray, count: int) -> list[BRepPrimAPI_MakeSphere]:
    """Neighbouring mirrors from the middle of one half, as solids of the kernel."""
    middle = array.u[np.argmax(array.u.sum(axis=1))]
    near = np.argsort(-array.u @ middle, kind="stable")[:count]
    every = spheres(array)
    return [BRepPrimAPI_MakeSphere(gp_Pnt(*every[k][0]), every[k][1]).Shape() for k in near]


def fused(parts: list[BRepPrimAPI_MakeSphere]) -> BRepAlgoAPI_Fuse:
    """The kernel's general fuse of all at once, on all cores."""
    first, others = TopTools_ListOfShape(), TopTools_ListOfShape()
    first.Append(parts[0])
    for part in parts[1:]:
        others.Append(part)
    fuse = BRepAlgoAPI_Fuse()
    fuse.SetArguments(first)
    fuse.SetTools(others)
    fuse.SetRunParallel(True)
    fuse.Build()
    if not fuse.IsDone():
        raise RuntimeError("the kernel does not fuse the spheres")
    return fuse

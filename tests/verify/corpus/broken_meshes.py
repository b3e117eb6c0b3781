"""Broken meshes: the same in STL and 3MF, so that no comparison of the two gives them away."""

from __future__ import annotations

import numpy as np

from tests.verify.corpus.facets import HALVES
from tests.verify.corpus.mesh_casings import aside, closed, dented_back, hanging, widened
from tests.verify.corpus.mesh_casings import grown as grown_back
from tests.verify.corpus.mesh_changes import (
    INCH,
    ascii_stl,
    backs,
    bent,
    cracked,
    dented,
    doubled,
    exchanged,
    flattened,
    grown,
    hollow,
    lies,
    loose,
    lost,
    lowered,
    mesh,
    mirrored,
    moved,
    number,
    only_3mf,
    only_stl,
    opened,
    post,
    rotated,
    shifted,
    splinter,
    stl_bytes,
    stretched,
    sunk,
    swapped,
    turned_one,
    warped,
    without,
)
from tests.verify.corpus.mutation import Mutation, fails, only, refused
from tests.verify.corpus.patches import fan, pushed

BOTH = "STL, 3MF"
FOUND = ("mirrors found", "surface error")
SIZE = "x the record's size"
MESHES: tuple[Mutation, ...] = (
    fails("a mirror moved 20 um sideways", BOTH, mesh(moved, 1), "centre error", "0.0200 mm"),
    fails("a mirror moved 20 um back", BOTH, mesh(lowered, 1), "centre error", "0.0200 mm"),
    fails("a mirror's radius 20 um too large", BOTH, mesh(grown, 1), "radius error", "0.0200 mm"),
    fails("a mirror bent by 20 um", BOTH, mesh(bent, 1), "radius error", "0.0200 mm"),
    fails("two mirrors' radii swapped", BOTH, swapped, "radius error"),
    fails("a mirror missing", BOTH, mesh(lost, 1), FOUND),
    fails("a mirror in a pit", BOTH, mesh(pushed(sunk), 1), "centre error", "1.0000 mm"),
    fails("a mirror flattened", BOTH, mesh(pushed(flattened), 1), FOUND),
    fails("a mirror hollow", BOTH, mesh(pushed(hollow), 1), FOUND),
    fails("a mirror dented by 10 um", BOTH, mesh(dented, 1), "surface error"),
    fails("a mirror warped by 3 um", BOTH, mesh(pushed(warped), 1), "form error", "RMS"),
    fails(
        "a mirror of too few facets", BOTH, mesh(lambda c, e: fan(c, e[0]), 1), "coverage, facets"
    ),
    # The STEP is right, and so little material is moved that its volume agrees.
    only(fails("a bolt hole 50 um too wide", BOTH, mesh(widened), "mesh holes", "of 4.35 mm")),
    only(fails("a bolt hole 50 um aside", BOTH, mesh(aside), "mesh holes", "0.05 mm from its")),
    only(fails("a bolt hole missing", BOTH, mesh(closed), "mesh holes", "4 holes of 4.3 mm")),
    only(fails("a dent in the back", BOTH, mesh(dented_back), "mesh wall", "the spec has 3")),
    fails("a tip below the foot", BOTH, mesh(hanging), "mesh seam and foot", "beyond the foot"),
    fails("a wall of 1 mm in the mesh", BOTH, mesh(grown_back(-2)), "mesh wall", "spec has 3"),
    fails("a wall of 9 mm in the mesh", BOTH, mesh(grown_back(6)), "mesh wall", "spec has 3"),
    fails("a crack, one last place wide", BOTH, mesh(cracked), "watertight", "open"),
    fails("a facet missing", BOTH, mesh(without(1)), "watertight", "3 open"),
    fails("a mirror's facets missing", BOTH, mesh(opened, 1), "mirrors found", "missing"),
    fails("a facet doubled", BOTH, mesh(doubled), "watertight", "3 with more than two facets"),
    fails("a facet turned", BOTH, mesh(turned_one), "watertight", "turned against"),
    fails("a facet without area", "STL", only_stl(splinter), "facets", "1 without area"),
    fails(
        "inside out", BOTH, mesh(lambda c, _: c[:, ::-1], 0, HALVES), "signed volume", "inside out"
    ),
    fails("stored normals turned", "STL", backs, "facets", "stored normal"),
    fails("in inches", BOTH, mesh(lambda c, _: c / INCH, 0, HALVES), "mirrors found", SIZE),
    fails("scaled by 25.4", BOTH, mesh(lambda c, _: c * INCH, 0, HALVES), "mirrors found", SIZE),
    fails("shrunk by 0.05 %", BOTH, mesh(stretched), "centre error"),
    fails("shifted by 20 um", BOTH, mesh(shifted(0, 0, 0.02)), "centre error", "0.020"),
    fails("one half turned by 0.1 mrad", BOTH, mesh(rotated), "centre error"),
    fails("one half its own mirror image", BOTH, mesh(mirrored), "mirrors found", "missing"),
    fails("the halves exchanged", BOTH, exchanged, "mirrors found"),
    fails("a loose piece in the light", BOTH, mesh(loose(15, 3)), "light paths"),
    fails("a loose piece in the wall", BOTH, mesh(loose(-1.5, 0.2)), "components", "one piece"),
    fails("a bubble in the wall", BOTH, mesh(loose(-1.5, 0.2, -1)), "components", "one piece"),
    fails("a post in the light", "STL, record", post, "light paths"),
    fails("20 um off in the STL only", "STL", only_stl(moved), "3MF", "elsewhere in the STL"),
    fails("20 um off in the 3MF only", "3MF", only_3mf(moved), "3MF", "elsewhere in the STL"),
    fails("a facet more in the 3MF", "3MF", only_3mf(doubled), "3MF", "facets, the STL has"),
    refused("NaN in a facet", "STL", mesh(number(np.nan)), "shell_a.stl", "not finite"),
    refused("infinity in a facet", "STL", mesh(number(np.inf)), "shell_a.stl", "not finite"),
    refused("an ASCII STL", "STL", ascii_stl, "shell_a.stl", "ASCII"),
    refused("an STL cut short", "STL", stl_bytes(lambda b: b[:-70]), "shell_a.stl", "truncated"),
    refused("an STL with a tail", "STL", stl_bytes(lambda b: b + b"x"), "shell_a.stl", "truncated"),
    refused("an STL of 4 G facets", "STL", stl_bytes(lies(2**32 - 1)), "4294967295 facets"),
    refused("an STL of no facets", "STL", stl_bytes(lambda b: b[:80] + bytes(4)), "0 facets"),
    refused("an empty STL", "STL", stl_bytes(lambda _: b""), "shell_a.stl", "0 bytes"),
)

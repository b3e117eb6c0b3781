"""CalculiX on the carrier of a build: quadratic tetrahedra that Gmsh makes of its STEP file."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tbcad.prototype.gravity.compliance import N_PER_G
from tbcad.prototype.gravity.sag import read_sag
from tbcad.records.tables import BallRow
from tbcad.types import Floats, Ints

pytestmark = [
    *(pytest.mark.clients, pytest.mark.slow),
    pytest.mark.skipif(not shutil.which("ccx"), reason="calculix-ccx is not installed"),
]

SIZE_MM, CURVED = 6.0, 8
MODULUS_MPA, POISSON, DENSITY = 2000.0, 0.37, 1.27e-9  # t/mm^3
G_MM_S2 = 9806.65
TURNED_G_CM3 = 2.70  # of the caps, which are of aluminium
BORE_MM = 8.0  # of the shaft, on which the part is held
MODULUS_SHARE = 0.25  # by which a printed modulus is known, and so what one factor may take up
NEAR_MM = 6.0  # nodes no farther from a ball's surface carry it
GMSH_TO_CALCULIX = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]


def tetrahedra(step: Path) -> tuple[Floats, Ints]:
    """Nodes (n, 3) in mm, and ten of them for each tetrahedron."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.importShapes(str(step))
        gmsh.model.occ.synchronize()
        options = {"MeshSizeMax": SIZE_MM, "MeshSizeFromCurvature": CURVED, "ElementOrder": 2}
        for name, value in options.items():
            gmsh.option.setNumber(f"Mesh.{name}", value)
        gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)
        gmsh.model.mesh.generate(3)
        tags, places, _ = gmsh.model.mesh.getNodes()
        _, _, corners = gmsh.model.mesh.getElements(3)
    finally:
        gmsh.finalize()
    index = np.zeros(int(tags.max()) + 1, int)
    index[tags.astype(int)] = np.arange(len(tags))
    return places.reshape(-1, 3), index[corners[0].astype(int)].reshape(-1, 10)


def deck(nodes: Floats, elements: Ints, held: Ints, loads: Floats) -> str:
    """A static analysis of loads (3, n, 3) with gravity along each axis."""
    lines = ["*NODE,NSET=ALL"]
    lines += [f"{i},{x:.9g},{y:.9g},{z:.9g}" for i, (x, y, z) in enumerate(nodes, 1)]
    lines.append("*ELEMENT,TYPE=C3D10,ELSET=PART")
    for number, corners in enumerate(elements[:, GMSH_TO_CALCULIX] + 1, 1):
        lines.append(f"{number},{','.join(map(str, corners))}")
    lines += ["*MATERIAL,NAME=PRINTED", "*ELASTIC", f"{MODULUS_MPA},{POISSON}", "*DENSITY"]
    lines += [f"{DENSITY}", "*SOLID SECTION,ELSET=PART,MATERIAL=PRINTED", "*NSET,NSET=HELD"]
    lines += [*(f"{node + 1}," for node in held), "*BOUNDARY", "HELD,1,3"]
    for axis, load in enumerate(loads):
        down = ",".join("1." if k == axis else "0." for k in range(3))
        lines += ["*STEP", "*STATIC", "*DLOAD,OP=NEW", f"PART,GRAV,{G_MM_S2},{down}"]
        lines.append("*CLOAD,OP=NEW")
        for node, k in np.argwhere(load):
            lines.append(f"{node + 1},{k + 1},{load[node, k]:.9g}")
        lines += ["*NODE PRINT,NSET=ALL", "U", "*END STEP"]
    return "\n".join(lines) + "\n"


def solved(folder: Path, text: str, count: int) -> Floats:
    """Displacements (3, n, 3) by each load."""
    (folder / "part.inp").write_text(text)
    program = shutil.which("ccx")
    assert program
    subprocess.run([program, "part"], cwd=folder, check=True, capture_output=True, timeout=900)
    words = [line.split() for line in (folder / "part.dat").read_text().splitlines()]
    numbers = [row for row in words if len(row) == 4 and row[0].isdigit()]
    return np.array(numbers, dtype=float).reshape(3, count, 4)[:, :, 1:]


def motions(arm: Floats) -> Floats:
    """What shifts and turns about a place do at arms (m, 3) from it, (3 m, 6)."""
    turn = np.cross(np.eye(3)[None], arm[:, None]).transpose(0, 2, 1)
    shift = np.broadcast_to(np.eye(3), turn.shape)
    return np.concatenate([shift, turn], axis=2).reshape(-1, 6)


def carrying(arm: Floats) -> Floats:
    """The smallest forces on nodes (m, 3) that carry a unit weight along x, y, z, (3, m, 3).

    They have no moment about the ball's centre, toward which its pads press.
    """
    wanted = np.eye(6)[:, :3]
    return np.linalg.lstsq(motions(arm).T, wanted)[0].T.reshape(3, -1, 3)


def off(found: Floats, expected: Floats) -> float:
    """Share by which arrays differ, root mean square."""
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def beside_the_base(turn: Floats) -> Floats:
    """Turns (s, k, 3) beside their mean over the balls: a calibration finds the base's."""
    return turn - turn.mean(axis=1, keepdims=True)


def test_seats_move_and_turn_as_in_calculix(prototype_build: Path, tmp_path: Path) -> None:
    found = read_sag(prototype_build)
    assert found is not None
    record = json.loads((prototype_build / "prototype.json").read_text())
    part = next(one for one in record["parts"] if one["name"] == "carrier")
    nodes, elements = tetrahedra(prototype_build / part["step"])
    nodes = nodes @ found.axes.T
    balls = BallRow.read(prototype_build)
    near = [
        np.flatnonzero(np.linalg.norm(nodes - at, axis=1) < ball.body_radius_mm + NEAR_MM)
        for at, ball in zip(found.centre, balls, strict=True)
    ]
    loads = np.zeros((3, len(nodes), 3))
    for at, which, ball in zip(found.centre, near, balls, strict=True):
        mass = ball.mass_g or 4e-3 / 3 * np.pi * ball.body_radius_mm**3 * TURNED_G_CM3
        loads[:, which] += mass * N_PER_G * carrying(nodes[which] - at)
    out = np.hypot(nodes[:, 1], nodes[:, 2])
    bore = out < BORE_MM / 2 + 0.05
    moved = solved(tmp_path, deck(nodes, elements, np.flatnonzero(bore), loads), len(nodes))
    theirs = [
        [np.linalg.lstsq(motions(nodes[which] - at), one[which].ravel())[0] for one in moved]
        for at, which in zip(found.centre, near, strict=True)
    ]
    expected = np.einsum("kga,sg->ska", theirs, found.gravity)
    shift, turn = expected[..., :3], expected[..., 3:]
    assert off(found.of["carrier"], shift) < 0.15
    pairs = {
        "shifts": (found.of["carrier"], shift),
        "turns": (found.seat_turn, turn),
        "turns beside the base's": tuple(map(beside_the_base, (found.seat_turn, turn))),
    }
    for name, (ours, theirs) in pairs.items():
        factor = float((ours * theirs).sum() / (theirs**2).sum())
        left = off(ours / factor, theirs)
        print(f"carrier of {len(nodes)} nodes, {name}: {factor:.3f} of CalculiX's, {left:.1%} left")
        assert abs(factor - 1) < MODULUS_SHARE
        assert left < 0.06

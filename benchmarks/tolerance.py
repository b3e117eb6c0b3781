"""Simulated builds by the fast model, against the same builds meshed, written and verified."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import numpy as np
from tbcad_verify.mesh.mesh import mesh_from_facets
from tbcad_verify.mesh.stl import parse
from tbcad_verify.record.export import Export
from tbcad_verify.record.export import read_export as read_record
from tbcad_verify.record.files import read
from tbcad_verify.shell.coverage import measure
from tbcad_verify.shell.optics import set_up
from tbcad_verify.shell.recover import recover
from timing import Figure, Row, at_least, at_most, in_turns, measured

from tbcad.cad.formats.mesh_files import write_stl
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.mirrors.record import write_record
from tbcad.core.optics.cells import Cells, cells_of
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.output.manifest import write_manifest
from tbcad.shell.halves import shell_envelope
from tbcad.shell.mesh import shell_mesh
from tbcad.tolerancing.montecarlo.builds import CoverageCase, MonteCarloCase, simulate
from tbcad.tolerancing.montecarlo.coverage import coverage
from tbcad.tolerancing.montecarlo.draws import ShellDraws, draw
from tbcad.tolerancing.montecarlo.edge_model import EdgeModel, edge_model
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors

COUNTS = (100, 300, 1000)
MESHED = 10
SEED = 1
# Errors that a mesh can represent as spheres, so that the verification can place them.
ERRORS = Errors(sphere_centre=Error(0.02), sphere_radius=Error(0.02), coating=Error(0.005))


def tolerance(folder: Path, rounds: int, meshed: int = MESHED) -> list[Row]:
    """Seconds for so many machines of the paper's design, and how many times as many meshes take.

    Args:
        folder: to write meshes into.
        rounds: how often the fast model is run.
        meshed: machines that are meshed, once.
    """
    made = design(load_spec(None))
    a, b = (edge_model(at) for at in reflectors(made))
    task = MonteCarloCase((a, b), ERRORS, SEED)
    fast = in_turns([partial(simulate, task, count) for count in COUNTS], rounds)
    each = [
        Figure(tuple(1000 * s / n for s in one.values)) for one, n in zip(fast, COUNTS, strict=True)
    ]
    slow, apart = _meshes(made, draw(ERRORS, SEED, range(meshed), len(a)), folder, (a, b))
    ratio = Figure(tuple(slow / (one / COUNTS[-1]) for one in fast[-1].values))
    rows = [
        measured(f"{n} simulated builds, each", one, "ms")
        for n, one in zip(COUNTS, each, strict=True)
    ]
    search = CoverageCase(task.edge_models, ERRORS, SEED, worst_only=True)
    worst = in_turns([partial(simulate, search, COUNTS[-1])], rounds)[0]
    return [
        *rows,
        measured("1,000 simulated builds, only the worst camera of each", worst, "s"),
        at_most("1,000 simulated builds of 1,657 virtual cameras", fast[-1], 60, "s"),
        at_most("- a build, to one of 100", each[-1].over(each[0]), 1.2, "times"),
        measured(
            f"a build meshed, written, read and measured, mean of {meshed}", Figure((slow,)), "s"
        ),
        at_least("- to the fast model", ratio, 100, "times"),
        at_most("- largest difference in coverage", Figure((apart,)), 0.05, "mm"),
    ]


def _meshes(
    made: MirrorDesign,
    draws: tuple[ShellDraws, ShellDraws],
    folder: Path,
    edge_models: tuple[EdgeModel, EdgeModel],
) -> tuple[float, float]:
    """Seconds a machine, and the largest difference from the fast model, mm."""
    folder.mkdir(parents=True, exist_ok=True)
    write_record(folder, made, shells=True)
    write_manifest(folder, "build")
    record, count = read_record(folder), len(draws[0])
    found = np.empty((count, 2 * len(made.arrays[0]) - int(edge_models[0].halved.sum())))

    start = time.perf_counter()
    for k in range(count):
        _write(made, draws, k, folder)
        found[k] = _measured(record)
    seconds = time.perf_counter() - start
    return seconds / count, float(np.abs(found - coverage(edge_models, draws)[0]).max())


def _write(made: MirrorDesign, draws: tuple[ShellDraws, ShellDraws], k: int, folder: Path) -> None:
    """Mesh both shells of a machine, as the exporter does."""
    first, body = made.arrays[0], shell_envelope(made)
    for array, drawn in zip(made.arrays, draws, strict=True):
        cells = _cells(array, drawn, k)
        cells = cells if array is first else cells.mirrored()
        facets = shell_mesh(made.spec, cells, body, first.apex_distance)
        facets = facets if array is first else facets.mirrored()
        write_stl(folder / f"shell_{array.camera_id}.stl", facets)


def _cells(array: MirrorArray, draws: ShellDraws, k: int) -> Cells:
    every, m, radius = array.cells.surfaces, len(array), draws.radius[k]
    apex = array.mirrors.apex + draws.centre[k] + radius[:, None] * array.mirrors.normal
    curvature = array.mirrors.curvature / (1 + radius * array.mirrors.curvature)
    walls = Surfaces(every.apex[m:], every.normal[m:], every.curvature[m:])
    spheres = Surfaces(apex, array.mirrors.normal, curvature)
    return cells_of(spheres.joined(walls), array.cells.triangles)


def _measured(record: Export) -> np.ndarray:
    """Coverage of every virtual camera by the verification."""
    meshes = [mesh_from_facets(parse(read(record.folder, part.stl))) for part in record.parts]
    found = [
        recover(one, record.cameras[part.camera].pinhole, record.target_mm / 2)
        for one, part in zip(meshes, record.parts, strict=True)
    ]
    return measure(set_up(record, meshes, found)).fitted

"""Mirrors on pedestals against spheres that meet, and simulated builds with all their errors."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from timing import Figure, Row, at_most, measured, spent_in_turns

from tbcad.cad.kernel.brep import Solid
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.shell.files import camera_solid, write_shell_solids
from tbcad.shell.halves import shell_envelope
from tbcad.shell.mesh import shell_mesh
from tbcad.tolerancing.montecarlo.builds import MonteCarloCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.process.process import load_process, process_errors

BUILDS, SEED = 1000, 1
KINDS = ("valley", "pedestal")
MEGABYTE = 1e6
PROCESSES = ("sla", "cnc")


def edges(folder: Path, rounds: int, builds: int = BUILDS) -> list[Row]:
    """Solids, meshes and sizes of both kinds of edge, and 1,000 builds by sla, n = 18.

    Args:
        folder: to write STEP files into.
        rounds: how often each is run.
        builds: that are simulated.
    """
    made = {kind: design(load_spec(None, ["n=18", f"shell.edges={kind}"])) for kind in KINDS}
    works = [partial(work, made[kind]) for work in (solid, mesh) for kind in KINDS]
    spent = [one.cpu for one in spent_in_turns(works, rounds)]
    rows = []
    for what, (valley, pedestal) in (("B-rep", spent[:2]), ("mesh", spent[2:])):
        rows += [
            measured(f"{what} of one half, processor time, spheres that meet", valley, "s"),
            measured(f"{what} of one half, processor time, pedestals", pedestal, "s"),
            at_most("- pedestals to spheres that meet", pedestal.over(valley), 2.5, "times"),
        ]
    return [*rows, _step_size(folder, made["pedestal"]), *_builds(made, rounds, builds)]


def _step_size(folder: Path, made: MirrorDesign) -> Row:
    folder.mkdir(parents=True, exist_ok=True)
    write_shell_solids(made, shell_envelope(made), folder, lambda _: None)
    sizes = tuple(path.stat().st_size / MEGABYTE for path in folder.glob("shell_?.step"))
    return at_most("STEP of one half, pedestals", Figure((max(sizes),)), 12, "MB")


def _builds(made: dict[str, MirrorDesign], rounds: int, builds: int) -> list[Row]:
    """Builds with warp, errors of each mirror, of walls and waviness: all that a process has."""
    names = {"valley": "spheres that meet", "pedestal": "pedestals"}
    rows = []
    for kind, one in made.items():
        models = edge_models(reflectors(one))
        cases = [MonteCarloCase(models, process_errors(load_process(p)), SEED) for p in PROCESSES]
        spent = spent_in_turns([partial(simulate, case, builds) for case in cases], rounds)
        for process, took in zip(PROCESSES, spent, strict=True):
            what = f"{builds:,} builds by {process}, all errors, {names[kind]}"
            rows += [
                measured(what, took.seconds, "s"),
                # 30 s on two cores; other programs lengthen the seconds on the clock.
                at_most("- seconds of both cores together", took.cpu, 60, "s"),
            ]
    return rows


def solid(made: MirrorDesign) -> Solid:
    """Camera a's solid, checked by the kernel."""
    return camera_solid(made, made.arrays[0], shell_envelope(made))


def mesh(made: MirrorDesign) -> object:
    """Camera a's mesh."""
    array = made.arrays[0]
    return shell_mesh(made.spec, array.modelled_cells, shell_envelope(made), array.apex_distance)


if __name__ == "__main__":
    import tempfile

    from circumstances import asked, show_and_write

    given = asked(__doc__ or "", "edges", rounds=1)
    with tempfile.TemporaryDirectory() as name:
        show_and_write(given.out, given.about, edges(Path(name), given.rounds))

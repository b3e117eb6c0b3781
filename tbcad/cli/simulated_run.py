"""Simulate the photographs of a run by a random build of the prototype."""

from dataclasses import replace

import typer

from tbcad.cli.app import command
from tbcad.options.machines import SimulateRunOptions
from tbcad.screen import stages


@command("simulate-run")
def simulate_run(options: SimulateRunOptions) -> int:
    """Simulate all photographs of a run by a random build of the prototype, or of the shell.

    Writes the folder that tbcad run writes, with truth.json: the build, which a calibration of
    these photographs should find.
    """
    from tbcad.api import simulate_run as simulate
    from tbcad.machine.record import truth_file

    with stages(2) as screen:
        run = simulate(
            replace(options, progress=screen.stage, detail=screen.detail, answer=screen.note)
        )
    record = run.record
    count = len(record.frames) * len(record.phases)
    typer.echo(
        f"{options.out}: {count} photographs of {len(record.frames)} frames, and the build as "
        f"{' and '.join(truth_file(name) for name in record.machines)}"
    )
    return 0

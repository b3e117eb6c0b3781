"""Units of work on a Dask cluster: python benchmarks/cluster.py EXPORT, or --try to see it work.

Simulated builds on worker processes of this machine; and units that only wait, as long as theirs
take and a round trip to a far worker, on up to 64 workers: what scheduler and client cost. These
are threads of this process, with the scheduler; on busy cores it takes an hour, and shows nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Any

import dask
from circumstances import RESULTS, asked, show_and_write
from distributed import LocalCluster
from timing import Figure, Row, at_least, measured

from tbcad.common.schedule import one_client, run_units
from tbcad.light.simulate.parallel import chunks
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.tolerancing.montecarlo.builds import BUILDS_PER_BATCH, MonteCarloCase
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.process.process import load_process, process_errors

BUILDS = 2000
UNIT_S, UNITS_EACH = 0.25, 10  # of a worker
ROUND_TRIPS_S = (0.0, 0.1)
FEW, MANY = (1, 2), (2, 16, 64)
WANTED = 70.0  # % of the time, of 64 workers
# A default `tbcad tolerance` of n = 18: its searches come one after the other.
SEARCHES, BATCHES, BATCH_S = 50, 10, 0.025
# Of each worker in a process with 63 others, which are no part of what 64 machines cost.
QUIET = {
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.profile.enabled": False,
}


def builds(export: Path, number: int) -> list[Row]:
    """The same simulated builds in one thread, and on one and two workers."""
    errors = process_errors(load_process("fdm"))
    case = MonteCarloCase(edge_models(read_export(export).reflectors), errors, 0)
    batches = [range(part.start, part.stop) for part in chunks(number, BUILDS_PER_BATCH)]
    run_units(case, batches[:1], workers=1)  # loads compiled loops, as workers do below
    alone = seconds(lambda: run_units(case, batches, workers=1))
    rows = [measured(f"{number} simulated builds, one thread without a cluster", alone, "s")]
    for count in FEW:
        with cluster(count, processes=True) as address:
            run_units(case, batches[:1] * 2 * count, address)
            taken = seconds(lambda at=address: run_units(case, batches, at))  # type: ignore[misc]
        rows.append(measured(f"- {count} workers", taken, "s"))
    return rows


def efficiency(counts: Sequence[int]) -> list[Row]:
    """Share of the time in which workers work, of units that wait."""
    rows = []
    for trip in ROUND_TRIPS_S:
        for count in counts:
            units = [UNIT_S + trip] * (UNITS_EACH * count)
            with cluster(count) as address, one_client(address):
                taken = seconds(lambda u=units, at=address: run_units(time.sleep, u, at))  # type: ignore[misc]
            share = Figure((100 * UNITS_EACH * UNIT_S / taken.median,))
            what = f"{count} workers at work, round trips of {1000 * trip:.0f} ms"
            row = (
                at_least(what, share, WANTED, "%")
                if count == MANY[-1]
                else measured(what, share, "%")
            )
            rows.append(row)
    return rows


def connections(steps: int) -> list[Row]:
    """Searches of a command by one client, and by one for each step."""
    rows = []
    for what, client in (("one client", one_client), ("one for each step", nullcontext)):
        with cluster(FEW[-1]) as address, client(address):

            def searches(at: str = address) -> None:
                for _ in range(steps):
                    run_units(time.sleep, [BATCH_S] * BATCHES, at)

            taken = seconds(searches)
        rows.append(measured(f"{steps} steps of searches, 2 workers, {what}", taken, "s"))
    return rows


def seconds(work: Callable[[], Any]) -> Figure:
    """On the clock."""
    start = time.perf_counter()
    work()
    return Figure((time.perf_counter() - start,))


@contextmanager
def cluster(workers: int, processes: bool = False) -> Iterator[str]:
    """A scheduler on loopback with workers of one thread, by its address."""
    made = LocalCluster(
        n_workers=workers,
        processes=processes,
        threads_per_worker=1,
        protocol="tcp",
        memory_limit=0,  # by default its 64th part, beyond which workers of one process pause
        dashboard_address=":0",
    )
    try:
        yield made.scheduler_address
    finally:
        with suppress(OSError):  # many workers on a busy machine may not end in time
            made.close()


def main() -> None:
    given = asked(
        __doc__ or "",
        "cluster",
        ("export", {"type": Path, "help": "folder written by tbcad build, n = 18"}),
        (
            "--try",
            {"dest": "few", "action": "store_true", "help": "little of each"},
        ),
    )
    if given.few and given.out.parent == RESULTS:
        raise SystemExit("--try measures nothing of worth: name another file with --out")
    number, counts, steps = (20, FEW, 2) if given.few else (BUILDS, MANY, SEARCHES)
    works = partial(builds, given.export, number), partial(efficiency, counts)
    rows: list[Row] = []
    with dask.config.set(QUIET):
        for work in (*works, partial(connections, steps)):
            rows += work()
            show_and_write(given.out, given.about, rows)  # what is stopped keeps what it has


if __name__ == "__main__":
    main()

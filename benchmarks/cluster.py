"""Units of work on a Dask cluster: python benchmarks/cluster.py EXPORT.

Simulated builds on worker processes of this machine; and units that only wait, as long as theirs
take and a round trip to a far worker, on up to 64 workers: what scheduler and client cost.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from circumstances import asked, show_and_write
from distributed import LocalCluster
from timing import Figure, Row, at_least, measured

from tbcad.common.schedule import one_client, run_units
from tbcad.light.simulate.parallel import chunks
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.tolerancing.montecarlo.builds import BUILDS_PER_BATCH, MonteCarloCase
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.process.process import load_process, process_errors

BUILDS = 4000
UNIT_S, UNITS_EACH = 0.25, 10  # of a worker
ROUND_TRIPS_S = (0.0, 0.02, 0.1)
FEW, MANY = (1, 2), (1, 2, 16, 64)
WANTED = 70.0  # % of the time, of 64 workers
# A default `tbcad tolerance` of n = 18: its searches come one after the other.
SEARCHES, BATCHES, BATCH_S = 50, 10, 0.025


def builds(export: Path) -> list[Row]:
    """The same simulated builds in one thread, and on one and two workers."""
    errors = process_errors(load_process("fdm"))
    case = MonteCarloCase(edge_models(read_export(export).reflectors), errors, 0)
    batches = [range(part.start, part.stop) for part in chunks(BUILDS, BUILDS_PER_BATCH)]
    alone = seconds(lambda: run_units(case, batches, workers=1))
    rows = [measured(f"{BUILDS} simulated builds, one thread without a cluster", alone, "s")]
    for count in FEW:
        with cluster(count, processes=True) as address:
            run_units(case, batches, address)  # imports and loads compiled loops
            taken = seconds(lambda at=address: run_units(case, batches, at))  # type: ignore[misc]
        rows.append(measured(f"- {count} workers", taken, "s"))
    return rows


def efficiency() -> list[Row]:
    """Share of the time in which workers work, of units that wait."""
    rows = []
    for trip in ROUND_TRIPS_S:
        for count in MANY:
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


def connections() -> list[Row]:
    """Searches of a command by one client, and by one for each step."""
    rows = []
    for what, client in (("one client", one_client), ("one for each step", nullcontext)):
        with cluster(FEW[-1]) as address, client(address):

            def searches(at: str = address) -> None:
                for _ in range(SEARCHES):
                    run_units(time.sleep, [BATCH_S] * BATCHES, at)

            taken = seconds(searches)
        rows.append(measured(f"{SEARCHES} steps of searches, 2 workers, {what}", taken, "s"))
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
        dashboard_address=None,
    )
    try:
        yield made.scheduler_address
    finally:
        with suppress(OSError):  # many workers on a busy machine may not end in time
            made.close()


if __name__ == "__main__":
    given = asked(__doc__ or "", "cluster", ("export", {"type": Path}))
    found = [*builds(given.export), *efficiency(), *connections()]
    show_and_write(given.out, given.about, found)

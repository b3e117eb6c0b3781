"""Virtual cameras against pixels: how many there are of each, and where they balance (Fig. 5b)."""

from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from tbcad.errors import InputError
from tbcad.simulate.study.definitions import definitions
from tbcad.simulate.study.paper import claimed, claims
from tbcad.simulate.study.pixels import (
    PixelCounts,
    Sensor,
    count_pixels,
    megapixels,
    virtual_cameras,
)
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Figure, Study
from tbcad.simulate.study.sweep import for_each_n, try_design
from tbcad.simulate.study.tables import Record, Table
from tbcad.spec.design import Spec
from tbcad.types import Floats, Progress

MULTIPLES = (1, 2, 3, 4)
COUNTED = (
    *("virtual_cameras", "seeing_px", "on_mirrors_px", "seeing_average_px"),
    *("on_mirrors_average_px", "frame_filled", "rays_traced"),
)
SHOWN = (
    "virtual cameras: directions with z >= 0",
    "seeing pixels / virtual cameras",
    "pixels on mirrors / virtual cameras",
)
KINDS = {"seeing": "seeing_average_px", "on mirrors": "on_mirrors_average_px"}
NOTES = (
    "Virtual cameras: directions with z >= 0; mirrors that the seam halves count once.",
    "Seeing pixels: those of both cameras whose ray, off its exact mirror, meets the capture "
    "sphere. Pixels on mirrors: all whose ray meets a mirror. Average: divided by virtual cameras.",
    "frame_filled is 1 when the outermost mirror is at the frame's edge; beyond 1 the frame of "
    "this sensor and lens does not hold all mirrors, and the rest have no pixels.",
    "rays_traced less than the sensor's pixels: one ray stood for a block of them.",
    "Only the paper's first and last sensor, 2080 x 1552 and 8320 x 6208, are known to us; that "
    "the two between are twice and three times the first is our assumption (--sensor).",
)
BALANCE_NOTES = (
    "Balanced n: where virtual cameras : average pixels is the ratio, between whole n on a "
    "straight line of the logarithms; nearest_n is the n of the sweep that comes nearest to it.",
    "Of the paper's Table II we know n = 18 for 2080 x 1552 at 1:1 only; other cells of paper_n "
    "are empty because they are not known to us.",
)


@dataclass(frozen=True)
class Ratio:
    """Virtual cameras to average pixels."""

    cameras: float
    pixels: float

    def __str__(self) -> str:
        """As the command takes it."""
        return f"{self.cameras:g}:{self.pixels:g}"


def parse_ratio(text: str) -> Ratio:
    """A ratio from text like 1:4.

    Raises:
        InputError: it is none, or not of numbers above 0 to 1000.
    """
    cameras, _, pixels = text.partition(":")
    try:
        ratio = Ratio(float(cameras), float(pixels))
    except ValueError:
        ratio = Ratio(0, 0)
    if 0 < ratio.cameras <= 1000 and 0 < ratio.pixels <= 1000:
        return ratio
    raise InputError(
        f"ratio {text!r}: allowed is cameras:pixels, each above 0 to 1000: write for instance 1:4"
    )


def default_sensors(spec: Spec) -> tuple[Sensor, ...]:
    """The design's sensor and its multiples up to four times the sides."""
    width, height = spec.camera.width_px, spec.camera.height_px
    return tuple(Sensor(k * width, k * height) for k in MULTIPLES)


def balance(n: Floats, cameras: Floats, pixels: Floats, ratio: Ratio) -> tuple[float, int]:
    """Where cameras : pixels is the ratio, and where in the sweep it comes nearest to that.

    Args:
        n: subdivisions in ascending order, (k,).
        cameras: number of virtual cameras, (k,); NaN where there was no design.
        pixels: average pixels of one, (k,).
        ratio: of cameras to pixels that is asked for.

    Returns:
        n on a continuous scale, NaN when it lies outside the sweep; and the place in the sweep of
        the n whose own ratio comes nearest.

    Cameras grow and pixels shrink with n^2, so the logarithm of their ratio is nearly a straight
    line over log n: linear between two neighbours it errs by less than 0.01 in n.
    """
    known = np.flatnonzero(np.isfinite(cameras) & (pixels > 0))
    if len(known) == 0:
        return np.nan, 0
    surplus = np.log(cameras[known] / pixels[known]) - np.log(ratio.cameras / ratio.pixels)
    nearest = int(known[np.argmin(np.abs(surplus))])
    after = np.flatnonzero((surplus[:-1] <= 0) & (surplus[1:] >= 0)) + 1
    if len(after) == 0:
        return np.nan, nearest
    pair = slice(after[0] - 1, after[0] + 1)
    where = np.interp(0, surplus[pair], np.log(n[known][pair]))
    return float(np.exp(where)), nearest


def resolution(
    spec: Spec,
    ns: range,
    sensors: tuple[Sensor, ...],
    ratios: tuple[Ratio, ...],
    progress: Progress = lambda _: None,
    scheduler: str | None = None,
) -> Study:
    """The study: counts for every n and sensor, and the n that balances them.

    Args:
        spec: the design; its n gives the table of definitions.
        ns: subdivisions to try.
        sensors: in place of the design's.
        ratios: of virtual cameras to average pixels.
        progress: called with each step.
        scheduler: address of a Dask scheduler; None for this machine's cores.
    """
    by_n = for_each_n(partial(_counts, spec, sensors), ns, progress, scheduler)
    counts = Table.of_records("resolution", [row for rows in by_n for row in rows], NOTES)
    balances = [_balance(counts, s, r, kind) for s in sensors for r in ratios for kind in KINDS]
    balanced = Table.of_records("resolution-balance", balances, BALANCE_NOTES)
    progress("definitions")
    defined = definitions(spec)
    figures = (*_definition_figures(defined), *map(_balance_figure, balances))
    panels = (_count_panel(counts, sensors), _balance_panel(balanced, ratios))
    return Study("resolution", figures, (counts, balanced, defined), panels)


def _counts(spec: Spec, sensors: tuple[Sensor, ...], n: int) -> list[Record]:
    """One n: a row for every sensor, or what a refusal says."""
    attempt, radius = try_design(spec, optics={"n": n}), spec.optics.capture_diameter_mm / 2
    heads: list[Record] = [{"n": n, **asdict(sensor)} for sensor in sensors]
    if attempt.half is None:
        return [{**head, **dict.fromkeys(COUNTED), "reason": attempt.reason} for head in heads]
    cameras = virtual_cameras(attempt.half)
    counts = count_pixels(attempt.half, sensors, radius)
    return [
        {**head, **_counted(cameras, one), "reason": ""}
        for head, one in zip(heads, counts, strict=True)
    ]


def _counted(cameras: int, counts: PixelCounts) -> Record:
    # Both cameras' pictures are mirror images, pixel by pixel.
    seeing, on = 2 * float(counts.seen.sum()), 2 * float(counts.on.sum())
    figures = (cameras, seeing, on, seeing / cameras, on / cameras, counts.fill, counts.rays)
    return dict(zip(COUNTED, figures, strict=True))


def _balance(counts: Table, sensor: Sensor, ratio: Ratio, kind: str) -> Record:
    counted = counts.where(**asdict(sensor))
    cameras, pixels = counted.numbers("virtual_cameras"), counted.numbers(KINDS[kind])
    n, place = balance(counted.numbers("n"), cameras, pixels, ratio)
    inside, nearest = not np.isnan(n), counted.records()[place]
    known = str(sensor) == "2080x1552" and ratio.cameras == ratio.pixels
    return {
        **asdict(sensor),
        "ratio": str(ratio),
        "pixels_counted": kind,
        "balanced_n": n if inside else None,
        "nearest_n": nearest["n"] if inside else None,
        "virtual_cameras": nearest["virtual_cameras"] if inside else None,
        "average_px": nearest[KINDS[kind]] if inside else None,
        "paper_n": int(claimed("design_n")) if known else None,
        "reason": "" if inside else "outside the sweep: change --from or --to",
    }


def _definition_figures(defined: Table) -> list[Figure]:
    """Definitions of the design itself beside the paper's two figures."""
    figures = []
    for record in defined.records():
        of_cameras = record["radii"] == "any"
        claim = claims()["virtual_cameras" if of_cameras else "other_count"]
        paper = None if record["paper"] is None else claim.value
        name = f"{record['definition']}, n = {record['n']}"
        name += "" if of_cameras else f", radii {record['radii']}"
        if record["definition"] in SHOWN:
            figures.append(Figure(name, "", record["value"], paper, claim.where if paper else ""))
    return figures


def _balance_figure(record: Record) -> Figure:
    names = "balanced n at {ratio}, {width_px}x{height_px}, {pixels_counted}"
    return Figure(names.format(**record), "", record["balanced_n"], record["paper_n"], "Table II")


def _count_panel(counts: Table, sensors: tuple[Sensor, ...]) -> Panel:
    first = counts.where(**asdict(sensors[0]))
    series = [Series("virtual cameras", first.numbers("n"), first.numbers("virtual_cameras"), "k-")]
    for k, sensor in enumerate(sensors):
        counted = counts.where(**asdict(sensor))
        label = f"seeing pixels of one, {sensor}"
        pixels = counted.numbers("seeing_average_px")
        series.append(Series(label, counted.numbers("n"), pixels, f"C{k}.-"))
    n = np.array([claimed("design_n")] * 2)
    paper = np.array([claimed("virtual_cameras"), claimed("other_count")])
    series.append(Series("the paper: 1657 and 1586 at n = 18", n, paper, "r+"))
    return Panel("Virtual cameras and pixels", "n", "number", tuple(series), logarithmic="xy")


def _balance_panel(balanced: Table, ratios: tuple[Ratio, ...]) -> Panel:
    series = []
    for k, ratio in enumerate(ratios):
        for kind, style in (("seeing", "o-"), ("on mirrors", "x--")):
            rows = balanced.where(ratio=str(ratio), pixels_counted=kind)
            label, n = f"{ratio}, {kind}", rows.numbers("balanced_n")
            series.append(Series(label, megapixels(rows), n, f"C{k}{style}"))
    series.append(Series("the paper", megapixels(balanced), balanced.numbers("paper_n"), "r+"))
    return Panel("Balanced n", "megapixels", "n", tuple(series), logarithmic="x")

"""Virtual cameras against pixels: how many there are of each, and where they balance (Fig. 5b)."""

from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.spec.design import Spec
from tbcad.errors import InputError
from tbcad.light.simulate.capture.photograph import (
    Sensor,
    allowed,
    count_pixels,
    virtual_cameras,
)
from tbcad.studies.definitions import DISC, IN_FRAME, definitions
from tbcad.studies.paper import (
    HEADINGS,
    NUMBER,
    RESOLUTION,
    TABLE_II,
    balanced_sensors,
    for_each_n,
    megapixels,
    notes,
    try_design,
    with_lens_of_table_i,
)
from tbcad.types import Floats, Progress

MULTIPLES = (0.5, 1, 2, 4)  # of the sides of the design's sensor: those of Table II
COUNTED = (
    *("virtual_cameras", "seeing_px", "on_mirrors_px", "seeing_average_px"),
    *("on_mirrors_average_px", "frame_filled", "rays_traced"),
)
# Definitions that agree with Table II, and with which of its columns.
AGREEING = ((IN_FRAME, RESOLUTION), (f"{DISC}, camera", NUMBER))
KINDS = {"seeing": "seeing_average_px", "on mirrors": "on_mirrors_average_px"}


@dataclass(frozen=True)
class Ratio:
    """Virtual cameras to average pixels."""

    cameras: float
    pixels: float

    def __str__(self) -> str:
        return f"{self.cameras:g}:{self.pixels:g}"


def parse_ratio(text: str) -> Ratio:
    """A ratio from text like 1:4; InputError: it is none, or not of numbers above 0 to 1000."""
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
    """The design's sensor and those of half, twice and four times its sides, as in Table II."""
    sides = spec.camera.width_px, spec.camera.height_px
    scaled = (tuple(round(k * side) for side in sides) for k in MULTIPLES)
    return tuple(Sensor(*sides) for sides in scaled if allowed(*sides))


def balance(n: Floats, cameras: Floats, pixels: Floats, ratio: Ratio) -> tuple[float, int]:
    """Where cameras : pixels is the ratio, and where in the sweep it comes nearest to that.

    Of n in ascending order, virtual cameras, NaN where there was no design, and average pixels of
    one, (k,) each: n on a continuous scale, NaN when it lies outside the sweep; and the place in
    the sweep of the n whose own ratio comes nearest.

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

    The table of definitions has the n of Table II. A Dask scheduler is given by its address; None:
    this machine's cores.
    """
    spec = with_lens_of_table_i(spec)
    by_n = for_each_n(partial(_counts, spec, sensors), ns, progress, scheduler)
    counts = Table.of_records(
        "resolution", [row for rows in by_n for row in rows], notes("resolution")
    )
    balances = [_balance(counts, s, r, kind) for s in sensors for r in ratios for kind in KINDS]
    balanced = Table.of_records("resolution-balance", balances, notes("resolution-balance"))
    progress("definitions")
    rows = tuple(r for r in balanced_sensors() if Sensor(r.width_px, r.height_px) in sensors)
    defined, fits = definitions(spec, rows, progress)
    figures = _definition_figures(defined)
    name = "balanced n at {ratio}, {width_px}x{height_px}, {pixels_counted}"
    for row in balances:
        figures.append(Figure(name.format(**row), "", row["balanced_n"], row["paper_n"], TABLE_II))
    panels = (_count_panel(counts, sensors), _balance_panel(balanced, ratios))
    return Study("resolution", tuple(figures), (counts, balanced, defined, fits), panels)


def _counts(spec: Spec, sensors: tuple[Sensor, ...], n: int) -> list[Record]:
    """One n: a row for every sensor, or what a refusal says."""
    attempt, radius = try_design(spec, optics={"n": n}), spec.optics.capture_diameter_mm / 2
    heads: list[Record] = [{"n": n, **asdict(sensor)} for sensor in sensors]
    if attempt.array is None:
        return [{**head, **dict.fromkeys(COUNTED), "reason": attempt.reason} for head in heads]
    cameras = virtual_cameras(attempt.array)
    rows: list[Record] = []
    for head, sensor in zip(heads, sensors, strict=True):
        one = count_pixels(attempt.array, sensor, radius)
        # Both cameras' pictures are mirror images, pixel by pixel.
        seeing, on = 2 * float(one.seen.sum()), 2 * float(one.on.sum())
        figures = (cameras, seeing, on, seeing / cameras, on / cameras, one.fill, one.rays)
        rows.append({**head, **dict(zip(COUNTED, figures, strict=True)), "reason": ""})
    return rows


def _balance(counts: Table, sensor: Sensor, ratio: Ratio, kind: str) -> Record:
    counted = counts.where(**asdict(sensor))
    cameras, pixels = counted.numbers("virtual_cameras"), counted.numbers(KINDS[kind])
    n, place = balance(counted.numbers("n"), cameras, pixels, ratio)
    inside, nearest = not np.isnan(n), counted.records()[place]
    paper = {(s.width_px, s.height_px): s.n for s in balanced_sensors()}
    known = paper.get((sensor.width_px, sensor.height_px))
    return {
        **asdict(sensor),
        "ratio": str(ratio),
        "pixels_counted": kind,
        "balanced_n": n if inside else None,
        "nearest_n": nearest["n"] if inside else None,
        "virtual_cameras": nearest["virtual_cameras"] if inside else None,
        "average_px": nearest[KINDS[kind]] if inside else None,
        "paper_n": known if ratio.cameras == ratio.pixels else None,
        "reason": "" if inside else "outside the sweep: change --from or --to",
    }


def _definition_figures(defined: Table) -> list[Figure]:
    """The definitions that agree with the columns of Table II, beside them."""
    figures = []
    for prefix, column in AGREEING:
        paper, where = f"paper_{column}", f"{TABLE_II}, '{HEADINGS[column]}'"
        for record in defined.records():
            if str(record["definition"]).startswith(prefix):
                name = "{width_px}x{height_px}, n = {n}: {definition}".format(**record)
                figures.append(Figure(name, "", record["value"], record[paper], where))
    return figures


def _count_panel(counts: Table, sensors: tuple[Sensor, ...]) -> PlotPanel:
    first = counts.where(**asdict(sensors[0]))
    series = [Series("virtual cameras", first.numbers("n"), first.numbers("virtual_cameras"), "k-")]
    for k, sensor in enumerate(sensors):
        counted = counts.where(**asdict(sensor))
        label = f"seeing pixels of one, {sensor}"
        pixels = counted.numbers("seeing_average_px")
        series.append(Series(label, counted.numbers("n"), pixels, f"C{k}.-"))
    rows = balanced_sensors()
    n = np.array([row.n for row in rows], dtype=np.float64)
    for k, (heading, style) in enumerate(zip(HEADINGS.values(), ("kx", "k+"), strict=True)):
        values = np.array([row.printed[k] for row in rows], dtype=np.float64)
        series.append(Series(f"{TABLE_II}: '{heading}'", n, values, style))
    title = "Virtual cameras, and pixels of one, over n"
    return PlotPanel(title, "subdivision n", "number", tuple(series), logarithmic="xy")


def _balance_panel(balanced: Table, ratios: tuple[Ratio, ...]) -> PlotPanel:
    series = []
    for k, ratio in enumerate(ratios):
        for kind, style in (("seeing", "o-"), ("on mirrors", "x--")):
            rows = balanced.where(ratio=str(ratio), pixels_counted=kind)
            label, n = f"{ratio}, pixels {kind}", rows.numbers("balanced_n")
            series.append(Series(label, megapixels(rows), n, f"C{k}{style}"))
    series.append(
        Series(f"{TABLE_II}, 1:1", megapixels(balanced), balanced.numbers("paper_n"), "k+")
    )
    title = "n that balances virtual cameras and pixels"
    return PlotPanel(title, "sensor, megapixels", "subdivision n", tuple(series), logarithmic="x")

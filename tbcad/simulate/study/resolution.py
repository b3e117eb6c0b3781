"""Virtual cameras against pixels: how many there are of each, and where they balance (Fig. 5b)."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorArray
from tbcad.simulate.study.definitions import definitions
from tbcad.simulate.study.paper import claimed, claims
from tbcad.simulate.study.pixels import PixelCounts, Sensor, count_pixels, virtual_cameras
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Study
from tbcad.simulate.study.sweep import for_each_n, spec_with, try_design
from tbcad.simulate.study.tables import SUMMARY, Cell, Table, joined
from tbcad.spec.design import Spec
from tbcad.types import Floats, Progress

MULTIPLES = (1, 2, 3, 4)
COLUMNS = (
    *("n", "width_px", "height_px", "virtual_cameras", "seeing_px", "on_mirrors_px"),
    *("seeing_average_px", "on_mirrors_average_px", "frame_filled", "rays_traced", "reason"),
)
BALANCE = (
    *("width_px", "height_px", "ratio", "pixels_counted", "balanced_n", "whole_n"),
    *("virtual_cameras", "average_px", "paper_n", "reason"),
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
    "straight line of the logarithms; whole_n is the n of the sweep that comes nearest to it.",
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


@dataclass(frozen=True)
class Balance:
    """Where virtual cameras and pixels are in a ratio.

    Attributes:
        n: on a continuous scale; NaN when it lies outside the sweep.
        nearest: place in the sweep of the n whose own ratio comes nearest.
    """

    n: float
    nearest: int


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
    one = Sensor(spec.camera.width_px, spec.camera.height_px)
    return tuple(one.times(k) for k in MULTIPLES)


def balance(n: Floats, cameras: Floats, pixels: Floats, ratio: Ratio) -> Balance:
    """Where cameras : pixels is the ratio.

    Args:
        n: subdivisions in ascending order, (k,).
        cameras: number of virtual cameras, (k,); NaN where there was no design.
        pixels: average pixels of one, (k,).
        ratio: wanted.

    Cameras grow and pixels shrink with n^2, so the logarithm of their ratio is nearly a straight
    line over log n: linear between two neighbours it errs by less than 0.01 in n.
    """
    known = np.flatnonzero(np.isfinite(cameras) & (pixels > 0))
    if len(known) == 0:
        return Balance(np.nan, 0)
    surplus = np.log(cameras[known] / pixels[known]) - np.log(ratio.cameras / ratio.pixels)
    nearest = int(known[np.argmin(np.abs(surplus))])
    after = np.flatnonzero((surplus[:-1] <= 0) & (surplus[1:] >= 0)) + 1
    if len(after) == 0:
        return Balance(np.nan, nearest)
    pair = slice(after[0] - 1, after[0] + 1)
    where = np.interp(0, surplus[pair], np.log(n[known][pair]))
    return Balance(float(np.exp(where)), nearest)


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
        progress: told how far it has come.
        scheduler: address of a Dask scheduler; None for this machine's cores.
    """
    found = for_each_n(partial(_of, spec, sensors), ns, progress, scheduler)
    swept = Table("resolution", COLUMNS, joined(row for rows in found for row in rows), NOTES)
    balanced = Table(
        "resolution-balance",
        BALANCE,
        joined(_balance_row(swept, s, r, k) for s in sensors for r in ratios for k in KINDS),
        BALANCE_NOTES,
    )
    progress("definitions")
    defined = definitions(spec)
    summary = Table("resolution-summary", SUMMARY, _summary(balanced, defined))
    panels = (_panel(swept, sensors), _balance_panel(balanced, ratios))
    return Study("resolution", summary, (swept, balanced, defined), panels)


def _of(spec: Spec, sensors: tuple[Sensor, ...], n: int) -> list[tuple[Cell, ...]]:
    return _rows(spec_with(spec, n=n), sensors)


def _rows(spec: Spec, sensors: tuple[Sensor, ...]) -> list[tuple[Cell, ...]]:
    """One n: a row for every sensor, or what a refusal says."""
    tried, n = try_design(spec), spec.optics.n
    if tried.made is None:
        return [(n, s.width_px, s.height_px, *[None] * 7, tried.reason) for s in sensors]
    half, radius = tried.made.halves[0], spec.optics.capture_diameter_mm / 2
    counted = count_pixels(half, sensors, radius)
    return [
        (n, s.width_px, s.height_px, *_cells(half, one), "")
        for s, one in zip(sensors, counted, strict=True)
    ]


def _cells(half: MirrorArray, counted: PixelCounts) -> tuple[Cell, ...]:
    cameras = virtual_cameras(half)
    # Both cameras' pictures are mirror images, pixel by pixel.
    seeing, on = (2 * float(x.sum()) for x in (counted.seen, counted.on))
    return cameras, seeing, on, seeing / cameras, on / cameras, counted.fill, counted.rays


def _of_sensor(swept: Table, sensor: Sensor) -> dict[str, Floats]:
    mine = np.array(swept.numbers("width_px")) == sensor.width_px
    mine &= np.array(swept.numbers("height_px")) == sensor.height_px
    names = ("n", "virtual_cameras", *KINDS.values())
    return {name: np.array(swept.numbers(name))[mine] for name in names}


def _balance_row(swept: Table, sensor: Sensor, ratio: Ratio, kind: str) -> tuple[Cell, ...]:
    at = _of_sensor(swept, sensor)
    n, cameras, pixels = at["n"], at["virtual_cameras"], at[KINDS[kind]]
    found = balance(n, cameras, pixels, ratio)
    head = (sensor.width_px, sensor.height_px, str(ratio), kind)
    paper = _paper_n(sensor, ratio)
    if np.isnan(found.n):
        return (*head, None, None, None, None, paper, "outside the sweep: change --from or --to")
    k = found.nearest
    return (*head, found.n, int(n[k]), int(cameras[k]), float(pixels[k]), paper, "")


def _paper_n(sensor: Sensor, ratio: Ratio) -> int | None:
    known = str(sensor) == "2080x1552" and ratio.cameras == ratio.pixels
    return int(claimed("design_n")) if known else None


def _summary(balanced: Table, defined: Table) -> tuple[tuple[Cell, ...], ...]:
    """Readings of the design itself beside the paper's two figures, then the balanced n."""
    one, other = claims()["virtual_cameras"], claims()["other_count"]
    rows: list[tuple[Cell, ...]] = []
    for row in defined.rows:
        at = dict(zip(defined.columns, row, strict=True))
        claim = one if at["radii"] == "any" else other
        paper = None if at["paper"] is None else claim.value
        name = f"{at['reading']}, n = {at['n']}"
        if at["reading"] in SHOWN:
            name += "" if at["radii"] == "any" else f", radii {at['radii']}"
            rows.append((name, "", at["value"], paper, claim.where if paper else ""))
    return (*rows, *(_balance_summary(row) for row in balanced.rows))


def _balance_summary(row: tuple[Cell, ...]) -> tuple[Cell, ...]:
    at = dict(zip(BALANCE, row, strict=True))
    sensor, ratio, kind = f"{at['width_px']}x{at['height_px']}", at["ratio"], at["pixels_counted"]
    name = f"balanced n at {ratio}, {sensor}, {kind}"
    return (name, "", at["balanced_n"], at["paper_n"], "Table II")


def _panel(swept: Table, sensors: tuple[Sensor, ...]) -> Panel:
    at = [_of_sensor(swept, sensor) for sensor in sensors]
    cameras = Series("virtual cameras", at[0]["n"], at[0]["virtual_cameras"], "k-")
    series = [
        Series(f"seeing pixels of one, {sensor}", one["n"], one["seeing_average_px"], f"C{k}.-")
        for k, (sensor, one) in enumerate(zip(sensors, at, strict=True))
    ]
    n = np.array([claimed("design_n")] * 2)
    paper = np.array([claimed("virtual_cameras"), claimed("other_count")])
    known = Series("the paper: 1657 and 1586 at n = 18", n, paper, "r+")
    return Panel(
        "Virtual cameras and pixels", "n", "number", (cameras, *series, known), logarithmic="xy"
    )


def _balance_panel(balanced: Table, ratios: tuple[Ratio, ...]) -> Panel:
    pixels = np.array(balanced.numbers("width_px")) * np.array(balanced.numbers("height_px"))
    n = np.array(balanced.numbers("balanced_n"))
    kind, ratio = np.array(balanced.column("pixels_counted")), np.array(balanced.column("ratio"))
    series = [
        Series(f"{each}, {name}", pixels[mine] / 1e6, n[mine], f"C{k}{style}")
        for k, each in enumerate(ratios)
        for name, style in (("seeing", "o-"), ("on mirrors", "x--"))
        for mine in [(kind == name) & (ratio == str(each))]
    ]
    known = np.array(balanced.numbers("paper_n"))
    series.append(Series("the paper", pixels / 1e6, known, "r+"))
    return Panel("Balanced n", "megapixels", "n", tuple(series), logarithmic="x")

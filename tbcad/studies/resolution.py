"""Virtual cameras against pixels: how many there are of each, and where they balance (Fig. 5b)."""

from dataclasses import asdict, dataclass
from functools import cache, partial

import numpy as np

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.common.schedule import run_units
from tbcad.core.camera.requirements import virtual_images
from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.mirrors.array import numbered_directions
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.design import Spec
from tbcad.errors import InputError
from tbcad.light.simulate.capture.photograph import (
    Sensor,
    allowed,
    count_pixels,
    virtual_cameras,
)
from tbcad.studies.paper import (
    HEADINGS,
    NUMBER,
    RESOLUTION,
    TABLE_II,
    BalancedSensor,
    balanced_sensors,
    for_each_n,
    megapixels,
    notes,
    try_design,
    with_lens_of_table_i,
)
from tbcad.studies.resolved import ResolvedSpots, spot_mm
from tbcad.types import Floats, Progress

MULTIPLES = (0.5, 1, 2, 4)  # of the sides of the design's sensor: those of Table II
COUNTED = (
    *("virtual_cameras", "seeing_px", "on_mirrors_px", "seeing_average_px"),
    *("on_mirrors_average_px", "frame_filled", "rays_traced"),
    *("best_pupil_mm", "resolved_average_spots", "ideal_spot_mm", "real_spot_mm"),
)
# From the vertical toward the object: the counts of apices in the frame of a camera that is turned
# so come nearest to the second column of Table II. The paper does not state where its cameras look.
PITCH_DEG = 17.86
KINDS = {
    "seeing": "seeing_average_px",
    "on mirrors": "on_mirrors_average_px",
    "resolved by a real lens": "resolved_average_spots",
}
LINES = dict(zip(KINDS, ("o-", "x--", "^:"), strict=True))


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

    A Dask scheduler is given by its address; None: this machine's cores.
    """
    spec = with_lens_of_table_i(spec)
    by_n = for_each_n(partial(_counts, spec, sensors), ns, progress, scheduler)
    counts = Table.of_records(
        "resolution", [row for rows in by_n for row in rows], notes("resolution")
    )
    balances = [_balance(counts, s, r, kind) for s in sensors for r in ratios for kind in KINDS]
    balanced = Table.of_records("resolution-balance", balances, notes("resolution-balance"))
    rows = [r for r in balanced_sensors() if Sensor(r.width_px, r.height_px) in sensors]
    figures = _table_ii_figures(spec, rows, progress)
    name = "balanced n at {ratio}, {width_px}x{height_px}, {pixels_counted}"
    for row in balances:
        figures.append(Figure(name.format(**row), "", row["balanced_n"], row["paper_n"], TABLE_II))
    panels = (_count_panel(counts, sensors), _balance_panel(balanced, ratios))
    return Study("resolution", tuple(figures), (counts, balanced), panels)


def _counts(spec: Spec, sensors: tuple[Sensor, ...], n: int) -> list[Record]:
    """One n: a row for every sensor, or what a refusal says."""
    capture = spec.optics.capture_diameter_mm
    attempt, radius = try_design(spec, optics={"n": n}), capture / 2
    heads: list[Record] = [{"n": n, **asdict(sensor)} for sensor in sensors]
    if attempt.array is None:
        return [{**head, **dict.fromkeys(COUNTED), "reason": attempt.reason} for head in heads]
    cameras, images = virtual_cameras(attempt.array), virtual_images(attempt.array, radius)
    rows: list[Record] = []
    for head, sensor in zip(heads, sensors, strict=True):
        one = count_pixels(attempt.array, sensor, radius)
        # Both cameras' pictures are mirror images, pixel by pixel.
        seeing, on = 2 * float(one.seen.sum()), 2 * float(one.on.sum())
        real = ResolvedSpots(images, one.seen, pixel_pitch(attempt.array.camera, sensor))
        average, spots = seeing / cameras, 2 * float(real.spots.sum()) / cameras
        figures = (
            *(cameras, seeing, on, average, on / cameras, one.fill, one.rays),
            *(real.best_pupil, spots, spot_mm(capture, average), spot_mm(capture, spots)),
        )
        rows.append({**head, **dict(zip(COUNTED, figures, strict=True)), "reason": ""})
    return rows


def pixel_pitch(camera: Camera, sensor: Sensor) -> float:
    """Width of a pixel at unit distance, with another sensor behind the lens of a camera."""
    return float(2 * np.tan(camera.hfov / 2) / sensor.width_px)


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


def _table_ii_figures(spec: Spec, rows: list[BalancedSensor], progress: Progress) -> list[Figure]:
    """What both columns of Table II count, of which the second comes first: mirrors, and pixels.

    The headings stand in the wrong order: only the second column grows with n as a number of
    mirrors does.
    """
    pixels = run_units(
        partial(disc_pixels, spec), rows, progress=lambda row: progress(f"Table II: n = {row.n}")
    )
    mirrors = [apices_in_frame(spec, row.n) for row in rows]
    counted = (
        ("mirrors of both arrays whose apex is in the frame", mirrors, RESOLUTION),
        ("disc pixels / mirrors", pixels, NUMBER),
    )
    return [
        Figure(
            f"{row.width_px}x{row.height_px}, n = {row.n}: {name}, camera pitched by "
            f"{PITCH_DEG:.1f} deg",
            "",
            value,
            getattr(row, column),
            f"{TABLE_II}, '{HEADINGS[column]}'",
        )
        for name, values, column in counted
        for row, value in zip(rows, values, strict=True)
        if value is not None
    ]


def disc_pixels(spec: Spec, row: BalancedSensor) -> float | None:
    """Mean pixels of a mirror that see the sphere within the largest cone that fits in it.

    With the paper's radii, n and sensor of a row, and pitched cameras; None: no such design.
    """
    spec = with_lens_of_table_i(spec)
    attempt = try_design(spec, optics={"n": row.n}, mirrors={"radius_rule": "paper"})
    if attempt.array is None:
        return None
    sensor, radius = Sensor(row.width_px, row.height_px), spec.optics.capture_diameter_mm / 2
    axes = axes_at_pitch(PITCH_DEG)
    return float(count_pixels(attempt.array, sensor, radius, axes=axes).disc.mean())


def apices_in_frame(spec: Spec, n: int, pitch_deg: float = PITCH_DEG) -> int:
    """Apices of both arrays in their cameras' frames; those on the seam count for both.

    Rows of pixels lie along y.
    """
    camera = with_lens_of_table_i(spec).camera
    half_width = np.tan(np.radians(camera.hfov_deg) / 2)
    half_height = half_width * camera.height_px / camera.width_px
    optics = spec.optics
    ray = _rays_to_apices(n, optics.camera_mm, optics.semi_minor_mm, optics.stretch)
    forward, right = axes_at_pitch(pitch_deg)
    depth, along, across = np.stack([forward, right, np.cross(forward, right)]) @ ray.T
    inside = (np.abs(along) <= half_width * depth) & (np.abs(across) <= half_height * depth)
    return 2 * int(inside.sum())


def axes_at_pitch(pitch_deg: float) -> tuple[Floats, Floats]:
    """Forward and right of camera a turned from the vertical toward the object, (3,) each."""
    pitch = np.radians(pitch_deg)
    return np.array([-np.sin(pitch), 0.0, np.cos(pitch)]), np.array([0.0, 1.0, 0.0])


@cache
def _rays_to_apices(
    n: int, pinhole: tuple[float, ...], semi_minor: float, stretch: tuple[float, float]
) -> Floats:
    """From camera a's pinhole to its mirrors' apices, mm, (m, 3)."""
    ellipsoid = Ellipsoid(np.array(pinhole), semi_minor)
    u = numbered_directions(n, stretch)[0]
    half_a = (u[:, 0] >= 0) & (u[:, 2] >= 0)
    return ellipsoid.apices(u[half_a]) - ellipsoid.pinhole


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
        for kind, style in LINES.items():
            rows = balanced.where(ratio=str(ratio), pixels_counted=kind)
            label, n = f"{ratio}, pixels {kind}", rows.numbers("balanced_n")
            series.append(Series(label, megapixels(rows), n, f"C{k}{style}"))
    series.append(
        Series(f"{TABLE_II}, 1:1", megapixels(balanced), balanced.numbers("paper_n"), "k+")
    )
    title = "n that balances virtual cameras and pixels"
    return PlotPanel(title, "sensor, megapixels", "subdivision n", tuple(series), logarithmic="x")

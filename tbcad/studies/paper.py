"""What the paper states (paper.csv, paper_table_ii.csv), and designs that differ in a few keys."""

import csv
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TypeVar

from tbcad.common.results import Table
from tbcad.common.schedule import run_units
from tbcad.core.mirrors.array import UNSTRETCHED, MirrorArray, MirrorDesign, design
from tbcad.core.spec.design import FIT, Spec, spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.errors import InputError
from tbcad.types import Floats, Progress

Result = TypeVar("Result")

MAX_N = 60


@dataclass(frozen=True)
class Claim:
    """A figure of the paper."""

    where: str  # figure, table or section
    text: str  # what is claimed
    value: float  # the figure
    unit: str  # of the figure; "" for a number


@dataclass(frozen=True)
class BalancedSensor:
    """A row of Table II, the columns as they are headed there."""

    width_px: int  # columns of the image sensor
    height_px: int  # its rows
    n: int  # subdivision whose two resolutions are closest
    number_of_virtual_camera: int  # the column of that name
    average_of_virtual_camera_resolution: int  # the column of that name

    @property
    def printed(self) -> tuple[int, int]:
        """Both columns."""
        return self.number_of_virtual_camera, self.average_of_virtual_camera_resolution


TABLE_II = "Table II"
NUMBER, RESOLUTION = "number_of_virtual_camera", "average_of_virtual_camera_resolution"
HEADINGS = {  # of Table II's columns, as they are printed
    NUMBER: "Number of virtual camera",
    RESOLUTION: "Average of virtual camera resolution",
}


@cache
def claims() -> dict[str, Claim]:
    """All figures outside Table II, by their key."""
    return {
        row["key"]: Claim(row["where"], row["claim"], float(row["value"]), row["unit"])
        for row in _rows("paper.csv")
    }


def claimed(key: str) -> float:
    """The paper's figure of one claim."""
    return claims()[key].value


@cache
def balanced_sensors() -> tuple[BalancedSensor, ...]:
    """The rows of Table II, the smallest sensor first."""
    return tuple(
        BalancedSensor(**{name: int(cell) for name, cell in row.items()})
        for row in _rows("paper_table_ii.csv")
    )


def with_lens_of_table_i(spec: Spec) -> Spec:
    """The design, with the view angle of Table I where it leaves the angle open.

    The angle that fits the mirrors changes with n, and with it the pixels of every mirror. A design
    whose cameras or mirrors are elsewhere than those of Table I needs a lens of its own.
    """
    if spec.camera.hfov_deg != FIT or not has_optics_of_table_i(spec):
        return spec
    camera = spec.camera.model_copy(update={"hfov_deg": claimed("hfov")})
    return spec.model_copy(update={"camera": camera})


def is_table_i(spec: Spec) -> bool:
    """Whether optics and lens of a design are those of Table I, whatever n, sensor and radii."""
    lens = with_lens_of_table_i(spec).camera
    return has_optics_of_table_i(spec) and lens.hfov_deg == claimed("hfov")


def has_optics_of_table_i(spec: Spec) -> bool:
    """Whether cameras, ellipsoids, directions and capture sphere are those of Table I."""
    optics = spec.optics
    return (
        list(optics.camera_mm) == [claimed("camera_x"), 0.0, claimed("camera_z")]
        and optics.semi_minor_mm == claimed("short_axis")
        and optics.stretch == UNSTRETCHED
        and optics.capture_diameter_mm == claimed("capture_diameter")
    )


@cache
def notes(table: str) -> tuple[str, ...]:
    """What the figures of a study's table mean and assume."""
    text = (files("tbcad.studies") / "notes.toml").read_text(encoding="utf-8")
    return tuple(tomllib.loads(text)[table])


def _rows(name: str) -> list[dict[str, str]]:
    text = (files("tbcad.studies") / name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


@dataclass(frozen=True)
class DesignAttempt:
    """A design, or why there is none."""

    design: MirrorDesign | None  # None where the spec was refused
    reason: str = ""  # what the refusal says, else ""

    @property
    def array(self) -> MirrorArray | None:
        """Camera a with its mirrors."""
        return self.design.arrays[0] if self.design else None


def try_design(spec: Spec, **sections: dict[str, object]) -> DesignAttempt:
    """The design of a spec with other values of some keys, or why there is none."""
    try:
        return DesignAttempt(design(spec_with(spec, **sections)))
    except SpecError as error:
        return DesignAttempt(None, str(error))


def n_range(first: int, last: int) -> range:
    """The subdivisions of a sweep, both ends included.

    InputError: there are none, or no design may have them.
    """
    if not 1 <= first <= last <= MAX_N:
        raise InputError(
            f"n from {first} to {last}: allowed is 1 to {MAX_N}, the first no more than the "
            "last: change --from or --to"
        )
    return range(first, last + 1)


def for_each_n(
    work: Callable[[int], Result], ns: range, progress: Progress, scheduler: str | None = None
) -> list[Result]:
    """Work for every n, results in the order of n.

    With a Dask scheduler, given by its address, work must be fit for pickling; None: this machine.
    """
    # The largest take longest, so they are begun first.
    return run_units(work, list(reversed(ns)), scheduler, lambda n: progress(f"n = {n}"))[::-1]


def megapixels(table: Table) -> Floats:
    """Millions of pixels of the sensors in a table's columns width_px and height_px, (k,)."""
    return table.numbers("width_px") * table.numbers("height_px") / 1e6

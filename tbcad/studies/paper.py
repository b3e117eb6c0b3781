"""What the paper states: its figures in paper.csv, Table II in paper_table_ii.csv."""

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from tbcad.core.mirrors.array import UNSTRETCHED
from tbcad.core.spec.design import FIT, Spec


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


def _rows(name: str) -> list[dict[str, str]]:
    text = (files("tbcad.studies") / name).read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))

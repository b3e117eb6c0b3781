"""mirrors.csv: the mirrors as recorded."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.record.columns import Columns, Texts, numbers, numbers_or_empty
from tbcad_verify.types import Bools, Floats

LARGEST = 1e12

Numbers = Annotated[Floats, numbers(-LARGEST, LARGEST)]
NumbersOrEmpty = Annotated[Floats, numbers_or_empty(-LARGEST, LARGEST)]


class Mirrors(Columns):
    """One mirror a row, M of them; centre and radius are NaN for planar mirrors."""

    most_rows: ClassVar[int] = 200_000

    id: Texts
    camera: Texts
    ux: Numbers
    uy: Numbers
    uz: Numbers
    px: Numbers
    py: Numbers
    pz: Numbers
    nx: Numbers
    ny: Numbers
    nz: Numbers
    cx: NumbersOrEmpty
    cy: NumbersOrEmpty
    cz: NumbersOrEmpty
    radius_mm: NumbersOrEmpty
    size_mm: Numbers
    theta0_deg: Numbers
    theta1_deg: Numbers
    polar_deg: Numbers
    azimuth_deg: Numbers
    cell_area_mm2: Numbers
    coverage_mm: Numbers

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Names of the mirrors."""
        return tuple(self.id.tolist())

    def take(self, index: NDArray[np.integer]) -> Mirrors:
        """The mirrors with these numbers, from 0, in this order."""
        columns = {name: getattr(self, name)[index] for name in Mirrors.model_fields}
        return Mirrors.model_construct(**columns)

    @property
    def flat(self) -> Bools:
        """(M,) true for planar mirrors, which have no radius."""
        return np.isnan(self.radius_mm)

    def surfaces(self) -> Surfaces:
        """The M reflecting surfaces, by apex, normal and radius."""
        curvature = np.where(self.flat, 0.0, 1 / np.where(self.flat, 1.0, self.radius_mm))
        return Surfaces(self.columns("px", 3), self.columns("nx", 3), curvature)

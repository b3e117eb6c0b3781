"""The same design with mirrors on the seam as they were while only their outlines counted."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.mirrors.array import design as mirrors_of
from tbcad.core.mirrors.radii import RadiusProblem
from tbcad.core.optics.windows import seam_gaps
from tbcad.core.spec.design import Spec
from tbcad.output.build import write_export
from tests.verify.corpus.copies import load, put


def not_aimed(folder: Path) -> Sequence[str]:
    """All files are those of a design whose halves are aimed at the origin; the worst half."""
    made = _design(Spec.model_validate(load(folder, "design.json")["spec"]))
    with TemporaryDirectory() as other:
        write_export(made, Path(other), ["shell"])
        for file in Path(other).iterdir():
            put(folder, file.name, file.read_bytes())
    array = made.arrays[0]
    gap = seam_gaps(array.cells, array.ellipsoid.pinhole, made.spec.optics.capture_diameter_mm / 2)
    return [array.ids[int(gap.argmax())]]


def _design(spec: Spec) -> MirrorDesign:
    """With the radii of outlines alone."""
    with patch.object(RadiusProblem, "missing_aim", lambda _, cells: np.zeros(cells.mirrors)):
        return mirrors_of(spec)

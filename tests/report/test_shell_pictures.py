"""What the picture of the shells shows: every mirror in its colour."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.core.mirrors.array import design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.report.shell_pictures import (
    mirror_of_facets,
    read_modelled,
)
from tbcad.shell.facets import mirror_facets
from tbcad.shell.files import camera_a_mesh

ROOT = Path(__file__).parents[2]
AFTERNOON = ROOT / "designs" / "afternoon-print.toml"


@pytest.mark.parametrize(
    ("file", "options"),
    [
        (None, ["n=3"]),
        (None, ["n=4", "radius_rule=flat"]),
        (None, ["n=5", "coating_um=400"]),
        (AFTERNOON, []),
    ],
    ids=["n = 3", "flat", "coat", "afternoon-print"],
)
def test_facets_belong_to_the_mirrors_that_they_were_made_for(
    file: Path | None, options: list[str], tmp_path: Path
) -> None:
    """All facets of the casing are grey, also where three corners lie on the edge of a mirror."""
    mirrors = design(load_spec(file, options))
    write_record(tmp_path, mirrors, shells=False)
    mesh, array = camera_a_mesh(mirrors), mirrors.arrays[0]
    made = mirror_facets(mirrors.spec, array.modelled_cells, array.apex_distance).mirror
    corners = mesh.vertices.astype(np.float32).astype(np.float64)[mesh.triangles]
    mirror, found = mirror_of_facets(corners, read_modelled(tmp_path, "a"))
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    front = np.arange(len(mesh.triangles)) < len(made)
    assert area[found != front].sum() < 1e-4 * area[front].sum()
    other = mirror[: len(made)] != made  # slivers along an edge lie on both of its mirrors
    assert area[: len(made)][other].sum() < 1e-4 * area[front].sum()
    assert not found[~front].any()

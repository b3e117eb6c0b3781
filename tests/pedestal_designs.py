"""Designs whose mirrors stand on pedestals, for tests."""

from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.optics.pedestals.cells import PedestalCells, pedestal_cells
from tbcad.core.optics.pedestals.plan import pedestal_plan
from tests.mirror_arrays import mirror_design

GROOVE = 0.1
# Of small shells on any edges: few mirrors, planar ones, a coat, a camera beside the axis.
OPTIONS = [
    ["n=2"],
    ["n=5"],
    ["n=4", "radius_rule=flat"],
    ["n=5", "coating_um=100"],
    ["n=5", "camera_mm=[120, 15, -90]"],
]


def pedestals(array: MirrorArray, groove: float = GROOVE) -> PedestalCells:
    """Pedestals below mirrors whose radii were found without grooves."""
    pinhole = array.camera.pinhole
    plan = pedestal_plan(array.cells.surfaces, array.cells.triangles, pinhole, groove)
    return pedestal_cells(plan, array.mirrors)


def pedestal_design(*settings: str) -> MirrorDesign:
    """The paper's design with other settings ("key=value"), its mirrors on pedestals."""
    return mirror_design("shell.edges=pedestal", *settings)

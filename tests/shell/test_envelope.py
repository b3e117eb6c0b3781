import numpy as np
import pytest
from scipy.spatial import cKDTree

from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.shell.envelope import Envelope, closing_envelope


def test_wall_behind_the_deepest_valley(small_half: MirrorArray, small_envelope: Envelope) -> None:
    """The smallest distance from any corner or arc to the back is the wall, within the samples."""
    arcs = small_half.modelled_cells.arcs
    arc, t = np.broadcast_arrays(np.arange(len(arcs))[:, None], np.linspace(0, 1, 9))
    valley = arcs.at(arc, t).reshape(-1, 3)
    rng = np.random.default_rng(3)
    unit = rng.normal(size=(400_000, 3))
    unit /= norm(unit)[:, None]
    back = small_envelope.back.centre + unit @ small_envelope.back.from_sphere
    assert 3.0 - 1e-6 < cKDTree(back).query(valley)[0].min() < 3.3


def test_ends_meet(small_envelope: Envelope) -> None:
    ends = np.array([0.0, 1.0])
    assert small_envelope.seam_back.at(ends) == pytest.approx(small_envelope.foot_back.at(ends))
    seam, foot = small_envelope.seam_rim.at(ends), small_envelope.foot_rim.at(ends)
    assert np.abs(seam[:, 0]).max() < 1e-9
    assert foot[:, 2] == pytest.approx(small_envelope.foot)
    # the seam flange stands on the foot flange
    assert foot[1, 1] >= seam[1, 1] + 1 - 1e-9
    assert foot[0, 1] <= seam[0, 1] - 1 + 1e-9


@pytest.mark.parametrize("which", ["seam", "foot"])
def test_holes_stay_inside_their_flange(small_envelope: Envelope, which: str) -> None:
    holes = getattr(small_envelope, f"{which}_holes")
    inner = getattr(small_envelope, f"{which}_back").at(np.linspace(0, 1, 4001))
    outer = getattr(small_envelope, f"{which}_rim").at(np.linspace(0, 1, 4001))
    plane = [1, 2] if which == "seam" else [0, 1]
    for centre, radius in zip(holes.centre, holes.radius, strict=True):
        for line in (inner, outer):
            assert norm(line[:, plane] - centre[plane]).min() > radius + 1.0


def test_too_many_holes_are_refused(small_half: MirrorArray) -> None:
    spec = load_spec(None, ["shell.seam_flange.bolts=60"])
    with pytest.raises(SpecError, match="holes") as caught:
        closing_envelope(spec.shell, small_half.modelled_cells, small_half.ellipsoid)
    assert "lower bolts" in str(caught.value)

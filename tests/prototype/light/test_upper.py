"""LEDs above the object: a pair by the half turn, clear of the base, even light, refused else."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.lamp_light import RectangularLamps, irradiance
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.light import upper
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.light.upper import UNEVEN, UpperLamps, upper_layout
from tbcad.prototype.part import FrameLayout, Site


def asked(site: Site, wanted: object) -> Site:
    """A site whose spec has another value of the key."""
    light = site.spec.prototype.light.model_copy(update={"upper": wanted})
    prototype = site.spec.prototype.model_copy(update={"light": light})
    return replace(site, spec=site.spec.model_copy(update={"prototype": prototype}))


@pytest.fixture(scope="module")
def lamps(site: Site, frame: FrameLayout) -> UpperLamps:
    """The pair in the frame of the small prototype, however even its light."""
    below = frame.of(LampLayout)
    return min(upper._Search(site, below).fitting(), key=UpperLamps.merit)


def test_the_pair_is_its_own_image_and_clear_of_the_base(site: Site, lamps: UpperLamps) -> None:
    half_turn = [-1.0, -1.0, 1.0]
    assert lamps.places[1] == pytest.approx(lamps.places[0] * half_turn, abs=1e-9)
    assert lamps.rods[1] == pytest.approx(lamps.rods[0] * half_turn, abs=1e-9)
    assert norm(lamps.places).min() > site.keep_out.capture
    need = site.spec.prototype.frame.clearance_mm
    ends = lamps.rods[0, 1:]
    along = ends[0] + np.linspace(0, 1, 50)[:, None] * (ends[1] - ends[0])
    assert site.keep_out.to_swept(along).min() >= need
    assert [one.name for one in lamps.printed] == ["upper_bar"]
    assert len(lamps.purchased) == 4
    assert [one.part.name for one in lamps.fasteners] == ["INSERT-M3", "SET-M3x8"]


def test_its_ratio_is_that_of_the_light_on_all_directions(
    site: Site, frame: FrameLayout, lamps: UpperLamps
) -> None:
    below = frame.of(LampLayout)
    lit = RectangularLamps(
        below.places,
        below.inward,
        *below.sides,
        below.lumen,
        lamps.places,
        lamps.candela,
    )
    points, normals = upper._surfaces(site.keep_out.capture)
    light = irradiance(lit, points, normals).reshape(2, -1)
    assert lamps.ratio == pytest.approx((light.max(axis=1) / light.min(axis=1)).max())
    dark = irradiance(replace(lit, candela=0.0), points, normals)
    assert dark[normals[:, 2] > 0.9].max() < 0.1 * light.max()


def test_it_is_refused_or_left_out_where_it_does_not_fit(site: Site, frame: FrameLayout) -> None:
    assert upper_layout(asked(site, False), frame) is None
    empty = FrameLayout(())
    assert upper_layout(asked(site, "auto"), empty) is None
    with pytest.raises(SpecError, match=r"light.upper: there are no lamps below.* or to false"):
        upper_layout(asked(site, True), empty)
    close = replace(site, keep_out=replace(site.keep_out, radius=site.keep_out.radius + 60))
    with pytest.raises(SpecError, match="no place between what the base sweeps and the object"):
        upper_layout(asked(close, True), frame)


def test_light_that_is_too_uneven_is_refused(
    site: Site, frame: FrameLayout, lamps: UpperLamps, monkeypatch: pytest.MonkeyPatch
) -> None:
    uneven = replace(lamps, ratio=UNEVEN + 1)
    monkeypatch.setattr(upper._Search, "fitting", lambda _: iter([uneven]))
    with pytest.raises(SpecError, match=r"gets 4\.8 times the light of .*, more than 3\.8"):
        upper_layout(asked(site, True), frame)

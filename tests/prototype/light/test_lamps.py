"""Lamps: images of one another, out of light, swing and view, refused where they cannot be."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest

from tbcad.core.optics.lamp_light import RectangularLamps, irradiance
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import StageSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.frame.shared import BearingHead
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.light import lamps as searched
from tbcad.prototype.light.lamp import POSTS, SHORT_STRIP, SIGNS, LampLayout, hidden_by_base
from tbcad.prototype.light.lamps import lamp_layout
from tbcad.prototype.part import FrameLayout, Mounted, Site


def lit(
    site: Site, frame: FrameLayout, beside: Mounted | None = None, **keys: object
) -> LampLayout | None:
    """The lamps beside the head and one part more, with other keys of their section."""
    light = site.spec.prototype.light.model_copy(update=keys)
    prototype = site.spec.prototype.model_copy(update={"light": light})
    changed = replace(site, spec=site.spec.model_copy(update={"prototype": prototype}))
    head = replace(frame.of(BearingHead), printed=(), purchased=())
    return lamp_layout(changed, FrameLayout((head, beside) if beside else (head,)))


def test_lamps_are_images_of_one_another_that_the_camera_does_not_see(
    frame: FrameLayout, small_prototype: PrototypeLayout
) -> None:
    lamps, camera = frame.find(LampLayout), small_prototype.array.camera
    assert lamps is not None
    assert lamps.places == pytest.approx(lamps.places[0] * SIGNS)
    assert (lamps.places * lamps.inward).sum(axis=1).max() < 0
    bars = [part.name for part in lamps.purchased if part.name in POSTS]
    assert bars == [*POSTS]
    assert [body.part for body in lamps.purchased[2:]] == ["STRIP-COB-24V"] * 4
    assert [part.name for part in lamps.printed] == ["lamp_holder_3", "lamp_holder_4"]
    assert (lamps.watt, lamps.lumen) == (pytest.approx(4.0), pytest.approx(90.0))
    assert lamps.current_ma == pytest.approx(4000 / 24)
    corners = lamps.outlines().reshape(-1, 3)
    assert camera.fill(corners[corners[:, 2] > camera.pinhole[2]]) > 1
    x, y, depth = ((corners - camera.pinhole) @ camera.axes.T).T
    half = camera.half_sizes
    assert not ((np.abs(x) < half[0] * depth) & (np.abs(y) < half[1] * depth)).any()


def test_light_of_the_lamps_is_that_on_upright_surfaces(frame: FrameLayout) -> None:
    """As summed over tiles and directions; the paper's design has 1025 lx over the whole room."""
    lamps = frame.find(LampLayout)
    assert lamps
    tiled = RectangularLamps(lamps.places, lamps.inward, *lamps.sides, lamps.lumen)
    angle = np.linspace(0, 2 * np.pi, 73)[:-1]
    normals = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    assert lamps.lux == pytest.approx(irradiance(tiled, 0 * normals, normals).mean(), rel=0.02)


def test_higher_lamps_have_no_room(site: Site, frame: FrameLayout) -> None:
    lamps = frame.of(LampLayout)
    again = lit(site, frame, lamp_z_mm=float(lamps.places[0, 2]))
    assert again is not None
    assert np.array_equal(again.places, lamps.places)
    with pytest.raises(SpecError, match=r"lamp_z_mm -5: .* set it to auto, or to 0 for no lamps"):
        lit(site, frame, lamp_z_mm=-5.0)
    with pytest.raises(SpecError, match="reach down to the base plate"):
        lit(site, frame, lamp_z_mm=site.spec.prototype.frame.floor_mm + 20)
    assert lit(site, frame, lamp_z_mm=0.0) is None
    with pytest.raises(SpecError, match="lamps take 3000 mA, more than the 1000"):
        lit(site, frame, strips=6, segments=6)


@contextmanager
def hiding(condition: Callable[[LampLayout], bool]) -> Iterator[None]:
    """A base that hides the lamps of some layouts, besides those that it hides; fewer tried."""

    def hidden(layout: LampLayout, stage: StageSpec, keep_out: KeepOut) -> bool:
        return condition(layout) or hidden_by_base(layout, stage, keep_out)

    with mock.patch.multiple(searched, hidden_by_base=hidden, ASIDE_MM=(0.0, -10.0), STEP_MM=5.0):
        yield


def test_two_level_lamps_where_four_have_no_room(site: Site, frame: FrameLayout) -> None:
    with hiding(lambda layout: not layout.level):
        lamps = lit(site, frame)
    assert lamps is not None
    assert lamps.level
    assert lamps.places[1] == pytest.approx(lamps.places[0] * [-1, -1, 1])
    assert lamps.sides == (lamps.length, lamps.width)
    assert [part.name for part in lamps.printed] == ["lamp_holder_1", "lamp_holder_2"]
    assert len(lamps.brackets) == 4
    assert len(lamps.fasteners) == 8  # a screw and a nut on each upright and each post
    assert lamps.screws == (lamps.places[0, 2],)


def test_short_strips_where_long_ones_have_no_room(site: Site, frame: FrameLayout) -> None:
    with hiding(lambda layout: layout.length > 30 or layout.places[0, 1] == 0):
        lamps = lit(site, frame)
    assert lamps is not None
    assert lamps.strip.name == SHORT_STRIP
    assert lamps.places[0, 1] != 0
    assert lamps.places[1] == pytest.approx(lamps.places[0] * [-1, -1, 1])


def test_level_lamps_keep_clear_of_other_parts(site: Site, frame: FrameLayout) -> None:
    """A part that is where they were found leaves no place at that height."""
    with hiding(lambda layout: not layout.level):
        lamps = lit(site, frame)
        assert lamps is not None
        bar, z = Mounted(printed=lamps.printed), float(lamps.places[0, 2])
        with pytest.raises(SpecError, match="meets the lamp holder 1"):
            lit(site, frame, bar, lamp_z_mm=z)

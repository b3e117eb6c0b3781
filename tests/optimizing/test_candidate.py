"""Figures of a candidate against counts and closed forms."""

from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.spec.load import load_spec, spec_dict
from tbcad.light.reconstruction import picture
from tbcad.light.reconstruction.picture import BY_FIELD
from tbcad.light.reconstruction.start import Level, Settings
from tbcad.light.simulate.capture.photograph import Sensor, virtual_camera_pixels
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.views.viewpoints import BY_NEAREST, ViewMethod, viewpoints_around
from tbcad.optimizing import candidate
from tbcad.optimizing.candidate import (
    MachineLimits,
    bounds,
    evaluate,
    figures_of,
    mean_ssim,
    place_of,
    placed,
    size_of,
)
from tbcad.options.captures import Optics
from tbcad.studies.ssim import ssim

FEW_PIXELS = ("n=4", "width_px=416", "height_px=310")
SPEC = load_spec(None, ["n=4", "width_px=208", "height_px=155"])


@pytest.fixture(scope="module")
def few() -> MirrorDesign:
    return design(load_spec(None, FEW_PIXELS))


def test_figures_are_those_of_all_virtual_cameras(few: MirrorDesign) -> None:
    each, figures = virtual_camera_pixels(few.arrays[0], 30.0), figures_of(few)
    assert figures.minimum_px == each.min()
    assert figures.median_px == np.median(each)
    assert figures.mean_log_px == pytest.approx(np.log(each).mean(), rel=1e-12)
    assert figures.variation == pytest.approx(each.std() / each.mean(), rel=1e-12)
    assert figures.view_angle_deg == few.spec.camera.hfov_deg


@pytest.mark.parametrize(
    ("pinhole", "size"), [((9.0, 0.0, -2.0), 18), ((5.0, 0.0, -2.0), 14), ((5.0, 0.0, -30.0), 33)]
)
def test_size_is_the_longest_side_of_a_box(pinhole: tuple[float, ...], size: float) -> None:
    """Apices up to 7 mm across, 3 mm up."""
    u = np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    camera = SimpleNamespace(pinhole=np.array(pinhole))
    array = SimpleNamespace(u=u, apex_distance=np.array([7.0, 3, 5]), camera=camera)
    assert size_of(cast(MirrorArray, array)) == size


def test_a_candidate_is_the_design_of_its_place() -> None:
    """Other keys stay."""
    kept = (*FEW_PIXELS, "shell.wall_mm=4", "prototype.frame.floor_mm=-250")
    spec = load_spec(None, [*kept, "camera_mm=[100, 7, -100]"])
    keys = ("camera_mm=[110, 7, -120]", "semi_minor_mm=105", "stretch=[1.2, 1.1]")
    moved, place = load_spec(None, [*kept, *keys]), (110.0, -120.0, 105.0, 1.2, 1.1)
    assert spec_dict(placed(spec, place)) == spec_dict(moved)
    one = evaluate(spec, None, place)
    assert (one.figures, one.reason) == (figures_of(design(moved)), "")


def test_the_first_place_is_within_the_bounds() -> None:
    spec = load_spec(None)
    for size in (10.0, 276.0, 900.0):
        limits = np.array(bounds(spec, size))
        assert (limits[:, 0] <= place_of(spec)).all()
        assert (place_of(spec) <= limits[:, 1]).all()


@pytest.fixture(autouse=True)
def few_views(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(candidate, "ELEVATIONS_DEG", (15.0,))
    monkeypatch.setattr(candidate, "AZIMUTHS", 1)
    monkeypatch.setattr(candidate, "_truth", cache(candidate._truth.__wrapped__))


@pytest.mark.parametrize(
    ("method", "of_study", "optics"),
    [
        ("nearest", BY_NEAREST, "ideal"),
        ("nearest", BY_NEAREST, "real"),
        pytest.param("field", BY_FIELD, "ideal", marks=pytest.mark.slow),
    ],
)
def test_it_is_the_figure_of_the_study(
    method: str, of_study: ViewMethod, optics: Optics, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture, "QUICK", Settings(levels=(Level(24, 1),), batch=3000))
    viewpoints = viewpoints_around((15.0,), 1, 640.0)
    wide = SPEC.camera.model_copy(update={"hfov_deg": 89.0})
    fixed = SPEC.model_copy(update={"camera": wide})  # as the study has it for the paper's optics
    width, height = (104, 77) if optics == "real" else (208, 155)  # a quarter of the pixels
    coarse = {"width_px": width, "height_px": height}
    studied = fixed.model_copy(update={"camera": wide.model_copy(update=coarse)})
    sensors, knot = (Sensor(width, height),), built_in_object(60.0)
    study = ssim(studied, knot, sensors, viewpoints, of_study, optics=optics)
    expected = study.tables[0].numbers("ssim").mean()
    assert mean_ssim(design(fixed), method, optics) == expected
    assert 0.3 < expected < 0.99
    assert f"; {method}; {optics} optics." in study.tables[0].notes[0]


def test_a_lens_that_blurs_makes_worse_views() -> None:
    """A pupil of 0.85 mm before pixels of 8 times the paper's design; nothing else is known."""
    made = design(SPEC)
    assert mean_ssim(made, optics="real") < mean_ssim(made, optics="ideal") - 0.002


@pytest.mark.parametrize(("size_mm", "measured"), [(300.0, True), (200.0, False)])
def test_views_are_compared_within_the_limits_only(size_mm: float, measured: bool) -> None:
    one = evaluate(SPEC, MachineLimits(size_mm, np.inf), place_of(SPEC))
    assert one.figures
    assert (one.figures.ssim is not None) == measured
    assert evaluate(SPEC, None, place_of(SPEC)).figures.ssim is None  # type: ignore[union-attr]

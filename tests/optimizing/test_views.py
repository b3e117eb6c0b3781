"""SSIM as an aim: the figure of the study, measured only within the limits."""

import numpy as np
import pytest

from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.light.reconstruction import picture
from tbcad.light.reconstruction.picture import BY_FIELD
from tbcad.light.reconstruction.start import Level, Settings
from tbcad.light.simulate.capture.photograph import Sensor
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.views.viewpoints import ELEVATIONS_DEG, viewpoints_around
from tbcad.optimizing import views
from tbcad.optimizing.candidate import MachineLimits, evaluate, place_of
from tbcad.optimizing.views import mean_ssim
from tbcad.studies.ssim import ssim

SPEC = load_spec(None, ["n=4", "width_px=208", "height_px=155"])


@pytest.fixture(autouse=True)
def few_views(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "ELEVATIONS_DEG", (15.0,))
    monkeypatch.setattr(views, "AZIMUTHS", 2)
    views._truth.cache_clear()


def test_it_is_the_figure_of_the_study() -> None:
    viewpoints = viewpoints_around((15.0,), 2, 640.0)
    fixed = SPEC.model_copy(
        update={"camera": SPEC.camera.model_copy(update={"hfov_deg": 89.0})}
    )  # as the study has it for the paper's optics
    study = ssim(fixed, built_in_object(60.0), (Sensor(208, 155),), viewpoints, "nearest")
    expected = study.tables[0].numbers("ssim").mean()
    assert mean_ssim(design(fixed)) == expected
    assert 0.3 < expected < 0.99


def test_the_viewpoints_are_those_of_the_study(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    assert vars(views)["ELEVATIONS_DEG"] is ELEVATIONS_DEG
    assert (views.AZIMUTHS, views.DISTANCE_MM) == (4, 640.0)


@pytest.mark.parametrize(("size_mm", "measured"), [(300.0, True), (200.0, False)])
def test_views_are_compared_within_the_limits_only(size_mm: float, measured: bool) -> None:
    one = evaluate(SPEC, MachineLimits(size_mm, np.inf), place_of(SPEC))
    assert one.figures
    assert (one.figures.ssim is not None) == measured
    assert evaluate(SPEC, None, place_of(SPEC)).figures.ssim is None  # type: ignore[union-attr]


def test_by_a_coarse_field_it_is_the_figure_of_that_study(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "QUICK", Settings(levels=(Level(24, 1),), batch=3000))
    monkeypatch.setattr(views, "AZIMUTHS", 1)
    viewpoints = viewpoints_around((15.0,), 1, 640.0)
    fixed = SPEC.model_copy(update={"camera": SPEC.camera.model_copy(update={"hfov_deg": 89.0})})
    study = ssim(fixed, built_in_object(60.0), (Sensor(208, 155),), viewpoints, BY_FIELD)
    expected = study.tables[0].numbers("ssim").mean()
    made = design(fixed)
    assert mean_ssim(made, "field") == expected != mean_ssim(made)
    assert 0.3 < expected < 0.99
    assert "; field." in study.tables[0].notes[0]

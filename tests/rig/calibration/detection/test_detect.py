"""Highlights of simulated photographs are found where they are; what is wrong is named."""

import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.special import j1

from tbcad.errors import InputError
from tbcad.records.run import exposure_name
from tbcad.rig.calibration.detection.detect import detect
from tbcad.rig.calibration.detection.detection import Detection, Rejection, no_highlights
from tbcad.rig.calibration.detection.matching import (
    Expected,
    Room,
    expected_highlights,
    highlights_of,
    sampling_shifts,
)
from tbcad.rig.calibration.detection.spots import find_spots
from tbcad.rig.machine.machine import Highlights
from tbcad.rig.runs import read_image, read_run
from tbcad.rig.simulated_run.photographs import ImagingChain
from tbcad.rig.simulated_run.simulate import write_run
from tbcad.types import Floats
from tests.exported_files import edit_json
from tests.photographed_runs import digest
from tests.simulated_runs import BRIGHT, Small, small_run

PHASES = ("dark", "led_1", "led_2", "led_3", "led_4")
TARGET_PX = 0.05
STOPS = range(8, 48, 6)
FEW = (8, 26, 44)  # stops
SLOPE = np.array([-0.02, 0.01])  # of the light for a pixel: larger than lenses have
WIDTH_PX = np.array([2.5, 1.5])  # standard deviations of the spot
BLUR_PX = 1.0  # of that, what is no image of a dome
PLACE = np.array([20.3, 18.6])
ONE = np.zeros(1, dtype=np.int64)


@pytest.fixture(scope="session")
def small(export_folder: Path) -> Small:
    return small_run(export_folder, STOPS)


@pytest.fixture(scope="session")
def photographed(
    small: Small, export_folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    folder = tmp_path_factory.mktemp("run") / "run"
    write_run((small.run,), PHASES, export_folder, folder, lambda _: None)
    return folder


@pytest.fixture
def copied(photographed: Path, tmp_path: Path) -> Path:
    """A run that a test may damage."""
    return Path(shutil.copytree(photographed, tmp_path / "run"))


@pytest.fixture
def write(export_folder: Path, tmp_path: Path) -> Callable[[Small], Path]:
    """Photographs another run."""

    def written(other: Small) -> Path:
        write_run((other.run,), PHASES, export_folder, tmp_path / "run", lambda _: None)
        return tmp_path / "run"

    return written


def detected(folder: Path, small: Small) -> Detection:
    return detect(read_run(folder), small.prior)


def errors(found: Highlights, small: Small) -> Floats:
    return found.pixel - small.machine.highlights(found.frame, found.sphere, found.led)


def reasons(found: Detection) -> Counter[str]:
    return Counter(found.rejected.values())


@pytest.fixture(scope="module")
def whole(photographed: Path, small: Small) -> Detection:
    return detected(photographed, small)


def test_centroids_are_right(whole: Detection, small: Small) -> None:
    off = errors(whole.highlights, small)
    assert len(whole.highlights) > 150
    assert np.sqrt((off**2).mean()) < TARGET_PX
    # No wrong match: the farthest is a noisy one, not another spot.
    assert np.hypot(*off.T).max() < 10 * TARGET_PX
    assert not whole.faults


def test_sigmas_are_those_of_the_errors(whole: Detection, small: Small) -> None:
    share = errors(whole.highlights, small) / whole.highlights.sigma[:, None]
    assert 0.5 < np.median(np.abs(share)) / 0.6745 < 1.5


def test_every_highlight_is_used_or_rejected_once(whole: Detection, small: Small) -> None:
    used = zip(whole.highlights.frame, whole.highlights.sphere, whole.highlights.led, strict=True)
    every = [*used, *whole.rejected]
    machine = small.machine
    count = len(machine.angle) * len(machine.radius) * len(machine.leds)
    assert len(every) == len(set(every)) == count


def test_outside_is_what_the_truth_has_outside(whole: Detection, small: Small) -> None:
    inside = expected_highlights(small.machine, 1.5).inside
    assert reasons(whole)[Rejection.OUTSIDE] == pytest.approx((~inside).sum(), abs=3)


def test_an_led_that_never_lights(write: Callable[[Small], Path], export_folder: Path) -> None:
    dead = ImagingChain(led_light=(BRIGHT, BRIGHT, 0.0, BRIGHT))
    small = small_run(export_folder, FEW, chain=dead)
    found = detected(write(small), small)
    assert "LED 3 shines in no photograph" in " ".join(found.faults)
    assert (found.highlights.led != 2).all()
    assert np.sqrt((errors(found.highlights, small) ** 2).mean()) < TARGET_PX


def test_a_camera_that_moves_in_mid_run(
    write: Callable[[Small], Path], export_folder: Path
) -> None:
    small = small_run(export_folder, STOPS)
    folder = write(_moved(small, first=8, shift=np.array([1.2, -0.9])))
    found = detected(folder, small)
    line = next(line for line in found.faults if "camera moved" in line)
    frames = small.run.frames
    before, after = (exposure_name(frames[k], "")[:-1] for k in (7, 8))
    assert f"between {before} and {after}" in line
    assert float(line.split("by ")[1].split(" px")[0]) == pytest.approx(1.5, abs=0.3)
    assert found.highlights.frame.max() == 7
    assert reasons(found)[Rejection.MOVED] > 30
    assert np.sqrt((errors(found.highlights, small) ** 2).mean()) < TARGET_PX


def _moved(small: Small, first: int, shift: Floats) -> Small:
    """The same run, whose picture shifts between two frames."""
    whole = type(small.run)
    machine = small.machine
    aside = replace(machine.camera, principal=machine.camera.principal + shift)
    built = replace(small.run.built, machine=replace(machine, camera=aside))
    other = replace(small.run, built=built)

    class Knocked(whole):
        def frame_photographs(self, number: int, phases: tuple[str, ...]) -> dict[str, object]:
            source = other if number >= first else small.run
            return source.frame_photographs(number, phases)

    run = Knocked(**{name: getattr(small.run, name) for name in whole.__dataclass_fields__})
    return replace(small, run=run)


def test_photographs_that_are_missing_or_damaged(
    copied: Path, small: Small, whole: Detection
) -> None:
    photographs, frames = copied / "photographs", small.run.frames
    lost, damaged = (exposure_name(frames[k], "led_2") for k in (2, 4))
    dark = exposure_name(frames[3], "dark")
    for name in (lost, dark):
        (photographs / f"{name}.json").unlink()
    (photographs / f"{damaged}.png").write_bytes(b"no picture")
    found = detected(copied, small)
    assert all(any(name in line for line in found.faults) for name in (lost, damaged))
    absent = {
        (frame, led)
        for (frame, _, led), why in found.rejected.items()
        if why == Rejection.NO_PHOTOGRAPH
    }
    assert absent == {(2, 1), (4, 1)}
    used = {*zip(found.highlights.frame.tolist(), found.highlights.led.tolist(), strict=True)}
    assert not used & absent
    assert (2, 0) in used
    assert f"{dark} is not there: its frame goes on with that of another" in " ".join(found.faults)
    # Hot pixels stay where they are, so nothing is lost.
    assert (found.highlights.frame == 3).sum() == (whole.highlights.frame == 3).sum()


def edit(run: Path, name: str, **changes: object) -> None:
    """Change what is told of a photograph."""
    edit_json(run / "photographs" / f"{name}.json", lambda record: record.update(changes))


def test_another_exposure_is_named_and_not_used(
    copied: Path, small: Small, whole: Detection
) -> None:
    """Of a photograph by an LED, and of a dark one, whose frame loses nothing."""
    names = exposure_name(small.run.frames[5], "led_1"), exposure_name(small.run.frames[3], "dark")
    for name in names:
        edit(copied, name, exposure_s=0.5)
    found = detected(copied, small)
    says = "was exposed for 0.5 s and not for 1 s as most photographs by LEDs: it is not"
    assert all(f"{name} {says}" in " ".join(found.faults) for name in names)
    lost = {(frame, led) for (frame, _, led), why in found.rejected.items()
            if why == Rejection.NO_PHOTOGRAPH}  # fmt: skip
    assert lost == {(5, 0)}
    frames = found.highlights.frame, whole.highlights.frame
    there, before = ((one != 5).sum() for one in frames)
    assert there == pytest.approx(before, abs=2)


@pytest.mark.parametrize(
    ("light", "says"),
    [
        (
            100 * BRIGHT,
            r"calibrate from: \d+ saturated: the light is saturated: photograph the LEDs",
        ),
        (BRIGHT / 1000, r"24 of 24 photographs by LEDs are black: most are too dark: see that"),
    ],
)
def test_no_highlights_are_told_by_reason(
    write: Callable[[Small], Path], export_folder: Path, light: float, says: str
) -> None:
    small = small_run(export_folder, FEW, chain=ImagingChain(led_light=light))
    with pytest.raises(InputError, match=says):
        detected(write(small), small)


def test_spots_that_are_no_highlights_of_this_machine(
    copied: Path, small: Small, export_folder: Path
) -> None:
    """A camera that looks elsewhere: nothing is near its place."""
    camera = small.machine.camera
    away = replace(camera, principal=camera.principal + 10 * camera.width_px)
    prior = replace(small.prior, mean=replace(small.prior.mean, camera=away))
    with pytest.raises(
        InputError, match=r"\d+ where no highlight is expected; .*: is this the run"
    ):
        detect(read_run(copied), prior)


def test_light_larger_than_a_highlight() -> None:
    image = np.zeros((200, 300, 3), np.uint8)
    image[20:80, 20:80] = 255
    image[120:180, 120:180] = 100
    image[50:54, 200:204] = 200
    spots, other = find_spots(image, None, 0, 0)
    assert len(spots) == 1
    assert other == Counter(large=2, saturated=1)
    flood = np.full((800, 800, 3), 200, np.uint8)
    assert find_spots(flood, None, 0, 0)[1] == Counter(flooded=1)
    assert find_spots(0 * flood, None, 0, 0)[1] == Counter(black=1)
    error = str(no_highlights(spots, other + other + Counter(flooded=3), 4))
    assert "4 larger than a highlight, 2 of them saturated" in error
    assert "most are full of light: darken the room" in error


def test_spots_that_are_no_highlights(copied: Path, small: Small, whole: Detection) -> None:
    """Light beside three highlights, or on one, each in a photograph of its own."""
    h, wanted = whole.highlights, {}
    for k, (aside, brightness, reason) in zip(
        np.linspace(0, len(h) - 1, 3).astype(int).tolist(),
        (
            (7.0, 200, Rejection.DOUBLE),
            (2.0, 200, Rejection.MERGED),
            (0.0, 255, Rejection.SATURATED),
        ),
        strict=True,
    ):
        frame, sphere, led = int(h.frame[k]), int(h.sphere[k]), int(h.led[k])
        name = exposure_name(small.run.frames[frame], f"led_{led + 1}")
        path = copied / "photographs" / f"{name}.png"
        pixels = np.array(read_image(path))
        x, y = np.rint(h.pixel[k] + np.array([aside, 0.0])).astype(int)
        pixels[y : y + 2, x : x + 2] = brightness
        Image.fromarray(pixels).save(path)
        edit(copied, name, sha256=digest(path))
        wanted[frame, sphere, led] = reason
    found = detected(copied, small)
    assert {one: found.rejected.get(one) for one in wanted} == wanted
    assert len({frame for frame, *_ in wanted}) == 3


def test_a_hidden_highlight_is_not_taken_for_another(
    write: Callable[[Small], Path], export_folder: Path
) -> None:
    small = small_run(export_folder, STOPS, subject_mm=36.0)
    folder = write(small)
    room = Room(radius=20.0, bottom=-19.0, top=23.0)
    found = detect(read_run(folder), small.prior, room)
    off = np.hypot(*errors(found.highlights, small).T)
    assert reasons(found)[Rejection.HIDDEN] > 10
    assert reasons(found)[Rejection.MISSING] == 0
    assert off.max() < 10 * TARGET_PX
    assert np.sqrt((off**2).mean() / 2) < TARGET_PX


def test_a_run_without_leds(copied: Path, small: Small) -> None:
    edit_json(copied / "run.json", lambda record: record.update(phases=["dark", "lit"]))
    with pytest.raises(InputError, match="has no photographs of single LEDs"):
        detected(copied, small)


def test_a_lens_that_darkens_one_side_does_not_shift_a_highlight() -> None:
    places = np.stack(np.meshgrid(np.arange(40), np.arange(40)), axis=-1) - PLACE
    spot = np.exp(-(places**2 / (2 * WIDTH_PX**2)).sum(axis=-1)) * np.exp(places @ SLOPE)
    image = np.rint(60_000 * spot / spot.max()).astype(np.uint16)
    found, _ = find_spots(np.dstack([image] * 3), None, 0, 0)
    zero = np.zeros((1, 2))
    dome = np.diag(WIDTH_PX**2 - BLUR_PX**2)[None]
    sure = np.ones(1, dtype=bool)
    expected = Expected(ONE, ONE, ONE, zero, zero, dome, zero, np.ones(1), sure, 1j * zero)
    darker = replace(expected, brighter=SLOPE[None])
    plain, right = (highlights_of(one, ONE, found, 0.01).pixel[0] for one in (expected, darker))
    assert plain - PLACE == pytest.approx(WIDTH_PX**2 * SLOPE, rel=0.05)
    assert right == pytest.approx(PLACE, abs=0.05 * np.abs(WIDTH_PX**2 * SLOPE).max())


@pytest.mark.parametrize("radius", [0.45, 0.9])
def test_sampling_shifts_a_sharp_spot_as_its_wave_says(radius: float) -> None:
    """An even disc, a lens of a sigma of 0.25 px, and pixels that are all sensitive."""
    fine, zero, blur = 40, np.zeros((1, 2)), 0.25
    across = (np.arange(15 * fine) + 0.5) / fine - 0.5
    wave = np.full((1, 2), j1(2 * np.pi * radius) / (np.pi * radius) + 0j)
    dome, sure = np.zeros((1, 2, 2)), np.ones(1, dtype=bool)
    expected = Expected(ONE, ONE, ONE, zero, zero, dome, zero, np.ones(1), sure, wave)
    for place in ([7.2, 6.9], [6.6, 7.33], [7.05, 7.4]):
        x, y = np.meshgrid(across - place[0], across - place[1])
        disc = gaussian_filter((x**2 + y**2 < radius**2).astype(float), blur * fine)
        image = np.rint(60_000 * disc.reshape(15, fine, 15, fine).mean(axis=(1, 3)))
        found, _ = find_spots(np.dstack([image.astype(np.uint16)] * 3), None, 0, 0)
        shift = np.exp(-2 * (np.pi * blur) ** 2) * sampling_shifts(expected, ONE, found)[0]
        assert found.pixel[0] - place == pytest.approx(shift, abs=5e-3)

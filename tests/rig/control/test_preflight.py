"""Exposures that will not do are found at one stop; those that will are set, kept and recorded."""

import io
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run as tbcad
from tbcad.errors import InputError
from tbcad.rig.control.base import Base
from tbcad.rig.control.cameras import CommandCamera
from tbcad.rig.control.photographs import EXIF, EXPOSURE, Photograph, Shot, common_settings, take
from tbcad.rig.control.plan import CameraFault
from tbcad.rig.control.preflight import look, preflight
from tbcad.rig.runs import read_run
from tests.rig.control import exposing_camera
from tests.rig.control.conftest import Told, closed
from tests.rig.control.exposing_camera import SIZE, radiance
from tests.rig.control.rig import Rig, connected_rig, events

GOOD = ("--exposure-leds", "1/100", "--exposure-lit", "2")


@pytest.fixture
def lit_rig(control_export: Path, tmp_path: Path, switch_deg: float) -> Iterator[Rig]:
    """Whose camera is told the exposure, before LEDs as bright as real ones."""
    yield from closed(connected_rig(control_export, tmp_path, switch_deg, view=radiance))


def words(rig: Rig, *more: str, stops: str | None = "1") -> list[str]:
    script = Path(exposing_camera.__file__)
    camera = f"command:{sys.executable} {script} {rig.picture} {{exposure_s}} {{output}}"
    every = rig.words("--phases", "dark,led_2,lit", *more, camera=camera, stops=stops)
    return [word for word in every if word != "--no-preflight"]


def test_exposures_that_will_not_do(lit_rig: Rig, cli: Callable[..., Any]) -> None:
    """One exposure for all: the LED is saturated, the object nearly so dark as to be lost."""
    err = cli(*words(lit_rig, "--exposure-lit", "0.1"), code=2).err
    assert (
        "led_2 at 0.1 s is saturated: peak 100% of the largest number, 100% of 5 highlights" in err
    )
    assert "lit at 0.1 s is too dark: peak 4% of the largest number" in err
    last = err.splitlines()[-1]
    assert last.startswith("tbcad: the preflight: led_2 is saturated, lit is too dark: photograph ")
    assert "with --exposure-leds 0.00747 --exposure-lit 1.53;" in last
    assert not lit_rig.out.exists()
    assert not lit_rig.controller.machine.lights


def test_preflight_only(lit_rig: Rig, cli: Callable[..., Any]) -> None:
    shown = cli(*words(lit_rig, *GOOD, "--preflight-only"))
    assert "every exposure will do" in shown.out
    for phase in ("dark at 0.01 s", "led_2 at 0.01 s", "dark_lit at 2 s", "lit at 2 s"):
        assert f"{phase} is good" in shown.err
    assert not lit_rig.out.exists()


def test_each_phase_has_its_exposure(lit_rig: Rig, refused: Told) -> None:
    assert tbcad(words(lit_rig, *GOOD)) == 0
    run = read_run(lit_rig.out)
    assert run.record.phases == ("dark", "led_2", "dark_lit", "lit")
    times = {one.phase: one.exposure_s for one in run.exposures.values()}
    assert times == {"dark": 0.01, "led_2": 0.01, "dark_lit": 2.0, "lit": 2.0}
    assert events(lit_rig.out) == ["started", *["taken"] * 8, "finished"]
    (lit_rig.out / "photographs" / "a_0001_lit.json").unlink()
    resumed = words(lit_rig, "--resume", stops=None)
    line = refused([*resumed, "--exposure-leds", "0.02"])
    assert "was begun with another --exposure: leave it out" in line
    assert tbcad([*resumed, *GOOD]) == 0
    assert read_run(lit_rig.out).exposures["a_0001_lit"].exposure_s == 2.0


def test_camera_on_the_relay_is_looked_at_too(rig: Rig, cli: Callable[..., Any]) -> None:
    """Its LEDs are at the largest number, and tbcad cannot change that."""
    every = rig.words("--phases", "dark,led_1,lit", "--runs", "b", camera=rig.released())
    err = cli(*(word for word in every if word != "--no-preflight"), code=2).err
    assert "object turned by 180 degrees" in err
    assert "run b, stop 2 at" in err
    assert "led_1 is saturated" in err
    assert "change the camera's exposure" in err.splitlines()[-1]
    # The trial and three phases: nothing else can be tried.
    assert len([*(rig.folder / "pictures").iterdir()]) == 4
    assert not rig.out.exists()


def test_controller_that_fails_in_the_preflight(lit_rig: Rig, refused: Told) -> None:
    lit_rig.controller.fault = lambda _, line: "reset" if line == "M64 P2" else None
    assert "the controller began anew at 'M64 P2'" in refused(words(lit_rig, *GOOD))
    assert not lit_rig.out.exists()
    assert not lit_rig.controller.machine.lights


@pytest.mark.parametrize(
    ("camera", "exposures", "says"),
    [
        ("folder:.", GOOD, "photograph two runs, one with --phases dark,leds"),
        ("command:cp a {output}", GOOD, "put one where the exposure belongs"),
        ("command:cp {exposure_us} {output}", (), "say --exposure-leds and --exposure-lit"),
        ("gphoto2", ("--exposure-lit", "1/0"), "--exposure-lit is '1/0', allowed are"),
        ("gphoto2", ("--exposure-leds", "nan"), "--exposure-leds is 'nan', allowed are"),
    ],
)
def test_cameras_that_cannot_be_told(
    rig: Rig, camera: str, exposures: tuple[str, ...], says: str, refused: Told
) -> None:
    assert says in refused(rig.words(*exposures, camera=camera))
    assert not rig.controller.lines


def pixels(level: float, size: int, number: int = 5) -> np.ndarray:
    """Some squares of a level on black, in 8 bits."""
    image = np.zeros((*SIZE[::-1], 3), np.uint8)
    for k in range(number):
        image[20 : 20 + size, 60 * k + 20 : 60 * k + 20 + size] = round(255 * level)
    return image


# Level, size of five squares.
STATES = """
led_1 0.8 3 good
led_1 1.0 3 saturated
led_1 0.1 3 too dark
led_1 0.8 1 too dark
led_1 0.01 3 too dark
lit 0.8 40 good
lit 1.0 40 saturated
lit 0.1 40 too dark
dark 1.0 3 good
dark 0.4 40 not dark
"""


@pytest.mark.parametrize("case", STATES.strip().splitlines())
def test_states(case: str) -> None:
    """A square of one pixel is a hot pixel."""
    phase, level, size, state = case.split(" ", 3)
    image = pixels(float(level), int(size))
    assert look(phase, image, np.zeros_like(image)).state == state
    assert look(phase, image.astype(np.uint16) * 257, None).state == state


def test_what_shines_in_the_dark_is_no_highlight() -> None:
    lamp = pixels(1.0, 3)
    assert look("led_1", lamp, lamp).highlights == 0
    assert look("led_1", lamp + pixels(0.6, 3, number=7) // 2, lamp).highlights == 2


def looked_at(*levels: float) -> list[str]:
    """The lines of a preflight whose LEDs give highlights of some levels."""
    lines: list[str] = []
    shots = {}
    for number, level in enumerate(levels, 1):
        file = io.BytesIO()
        Image.fromarray(pixels(level, 3)).save(file, "PNG")
        shots[f"led_{number}"] = Shot(file.getvalue(), ".png", {})
    preflight(dict.fromkeys(shots), lambda phase, _: shots[phase], "camera, stop", lines.append)
    return lines


def test_leds_share_an_exposure() -> None:
    weak, bright = looked_at(0.1, 0.6)
    assert weak.startswith("preflight, camera, stop: led_1 is good: peak 10% of the largest")
    assert "led_2 is good: peak 60%" in bright


@pytest.mark.parametrize(
    ("levels", "says"),
    [
        ((0.6, 0.0), "led_2 is too dark: see to the LED's wires, or leave it out with --phases;"),
        ((0.1, 0.0), "led_1 is too dark, led_2 is too dark: change the camera's exposure"),
        ((0.6, 1.0), "led_2 is saturated: change the camera's exposure, or say one for each light"),
    ],
)
def test_leds_that_will_not_do(levels: tuple[float, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        looked_at(*levels)


def photograph(**settings: str) -> Photograph:
    return Photograph(Shot(b"", ".jpg", {}), (64, 48), "", dict(settings), 1.0)


def test_exposure_alone_may_differ_between_phases() -> None:
    short = photograph(iso="100", shutterspeed="1/60")
    long = photograph(iso="100", shutterspeed="2")
    assert common_settings([short, long]) == {"iso": "100"}
    assert common_settings([short]) == {"iso": "100", "shutterspeed": "1/60"}
    brighter = photograph(iso="800", shutterspeed="2")
    with pytest.raises(CameraFault, match="iso is 100 at one exposure time and 800 at another"):
        common_settings([short, brighter])


def test_photograph_that_was_exposed_otherwise_is_none(rig: Rig) -> None:
    """The command takes no notice of what it is told, and its file says so."""
    file = rig.folder / "exposed.jpg"
    exif = Image.Exif()
    exif.get_ifd(EXIF)[EXPOSURE] = 0.5
    Image.new("RGB", SIZE).save(file, exif=exif)
    camera = CommandCamera(f"cp {file} {{output}}.jpg", 10.0)
    base = cast("Base", None)  # releases nothing
    assert take(camera, base).told_s == take(camera, base, 0.45).told_s == 0.5
    with pytest.raises(CameraFault, match=r"0.1 s of exposure were asked for.*has 0.5 s"):
        take(camera, base, 0.1)

"""A machine without hardware: a double, what stands before the camera, and checks of its run."""

import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from threading import Timer
from time import monotonic, sleep
from typing import Any

import numpy as np
from PIL import Image

from tbcad.app.cli import run as tbcad
from tbcad.rig.control.plan import read_settings
from tbcad.rig.runs import read_photograph, read_run
from tests.rig.control.exposing_camera import SIZE
from tests.rig.control.grbl_double import Fault, GrblDouble, Machine
from tests.rig.control.klipper_double import KlipperDouble, printer_settings

OUTPUTS = {"dark": (), "led_1": (1,), "led_2": (2,), "led_3": (3,), "led_4": (4,), "lit": (0,)}
ALL = 2 * 2 * len(OUTPUTS)  # photographs at two stops
FAST = 2000.0  # of the controller's time
TIMES = {"taken", "seconds"}
NEIGHBOURS = (-1, 0, 1)  # tenths of a degree: the program's angles are truncated


PER_STOP = 12
PHOTOGRAPH = 4  # lines
DELAY_S = 0.008  # in which a photograph comes from the camera to the disk
ROOT = Path(__file__).parents[3]
PICTURE = "scene.jpg"
PICTURE_BYTES = 16_384  # the virtual camera asks for a file's size once
LIT = 255


@lru_cache(maxsize=256)
def scene(angle: float, lights: frozenset[int]) -> bytes:
    """What is seen at a base angle, rounded to 0.1 degrees, under some lights: a JPEG file."""
    pixels = np.zeros((SIZE[1], SIZE[0]), np.uint8)
    pixels[:, : round(angle + 180)] = 40  # a bar for the angle
    for light in lights:
        pixels[30 * light : 30 * light + 20] = LIT
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "JPEG", quality=60)
    data = file.getvalue()
    assert len(data) < PICTURE_BYTES
    return data + bytes(PICTURE_BYTES - len(data))


def scene_of(machine: Machine) -> bytes:
    return scene(round(machine.angle, 1), frozenset(machine.lights))


def put(path: Path, data: bytes) -> None:
    """Replace a file as a whole."""
    partial = path.with_suffix(".part")
    partial.write_bytes(data)
    partial.replace(path)


@dataclass
class Rig:
    """A controller, and a picture of what it shows."""

    controller: Any  # on a pseudo-terminal; or a port of loopback
    export: Path  # that describes the machine
    folder: Path  # for pictures and runs

    @property
    def picture(self) -> Path:
        return self.folder / "view" / PICTURE

    @property
    def copying(self) -> str:
        """--camera of a command that copies the picture."""
        return f"command:cp {self.picture} {{output}}.jpg"

    @property
    def out(self) -> Path:
        return self.folder / "run"

    def words(self, *more: str, camera: str | None = None, stops: str | None = "1-2") -> list[str]:
        """A command line of tbcad."""
        return [
            *("run", str(self.export), "--port", self.controller.port, "--out", str(self.out)),
            *("--camera", camera or self.copying, "--yes", "--no-preflight", *more),
            *(("--stops", stops) if stops else ()),
        ]

    def counting(self, cases: str) -> str:
        """--camera of a command that copies the picture, or else by the call: cases of a shell."""
        script = self.folder / "camera.sh"
        script.write_text(
            f"cd {self.folder}; echo >> n; case $(wc -l < n) in {cases};; "
            f'*) cp {self.picture} "$1.jpg";; esac\n'
        )
        return f"command:sh {script} {{output}}"

    def released(self, missed: Sequence[int] = ()) -> str:
        """--camera of a folder into which a release brings a photograph, but for some releases."""
        pictures = self.folder / "pictures"
        pictures.mkdir()
        numbers = iter(range(1, 1000))

        def release(machine: Machine) -> None:
            if (number := next(numbers)) not in missed:
                put(pictures / f"DSC_{number:04d}.JPG", scene_of(machine))

        self.controller.released = release
        return f"folder:{pictures}"

    def resume(self) -> list[str]:
        """The command line that goes on."""
        return self.words("--resume", stops=None)

    def environment(self) -> dict[str, str]:
        """Of a process that has the virtual camera and sees the picture by it."""
        spec = find_spec("gphoto2")
        assert spec is not None
        assert spec.origin is not None
        return os.environ | {
            "IOLIBS": str(Path(spec.origin).parent / "libgphoto2" / "vusb"),
            "VCAMERADIR": str(self.picture.parent),
            "HOME": str(self.folder),  # the library keeps settings there
        }

    def start(
        self,
        words: list[str],
        module: str = "tests.rig.control.impatient",
    ) -> "subprocess.Popen[str]":
        """A command in a process of its own, with the virtual camera."""
        return subprocess.Popen(
            [sys.executable, "-m", module, *words],
            cwd=ROOT,
            env=self.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
        )


def connected_rig(
    export: Path,
    folder: Path,
    switch_deg: float,
    firmware: str = "grblhal",
    angle: float = 3.7,
    view: Callable[[Machine], bytes] = scene_of,
) -> Rig:
    """A rig whose controller shows the camera what its machine looks like."""
    settings = read_settings(export / "grbl_settings.txt") | {3: 0.0, 11: 0.01}
    return _started(GrblDouble(settings, switch_deg, firmware, angle), export, folder, view)


def klipper_rig_of(export: Path, folder: Path, switch_deg: float) -> Rig:
    """A rig whose printer is configured as the build says."""
    settings = printer_settings(export / "klipper.cfg")
    return _started(KlipperDouble(settings, switch_deg), export, folder, scene_of)


def _started(controller: Any, export: Path, folder: Path, view: Callable[[Machine], bytes]) -> Rig:
    rig = Rig(controller, export, folder)
    rig.picture.parent.mkdir()
    controller.see = lambda machine: put(rig.picture, view(machine))
    controller.see(controller.machine)
    controller.start()
    return rig


def at(
    start: str, what: str | None, act: Callable[[], object] = lambda: None, number: int = 2
) -> Fault:
    """A fault of the second line that begins so, or of another number."""
    seen: list[str] = []

    def fault(_: int, line: str) -> str | None:
        if line.startswith(start):
            seen.append(line)
            if len(seen) == number:
                act()
                return what
        return None

    return fault


def until(condition: Callable[[], bool], seconds: float = 600.0) -> None:
    """Wait for something that a thread does."""
    end = monotonic() + seconds
    while not condition():
        assert monotonic() < end
        sleep(0.002)


def check_every_photograph(folder: Path, count: int) -> None:
    """Each is of its place under its light, byte for byte as the camera gave it."""
    run = read_run(folder)
    assert not run.faults
    assert len(run.exposures) == count
    for exposure in run.exposures.values():
        image = (folder / "photographs" / exposure.file).read_bytes()
        angle, lights = exposure.frame.base_angle_deg, frozenset(OUTPUTS[exposure.phase])
        assert image in {scene(round(angle + tenth / 10, 1), lights) for tenth in NEIGHBOURS}
        assert read_photograph(run, exposure).shape == (*SIZE[::-1], 3)
    names = {path.name for path in (folder / "photographs").iterdir()}
    assert names == {one.file for one in run.exposures.values()} | {
        f"{name}.json" for name in run.exposures
    }
    taken = [line["name"] for line in journal(folder) if line["event"] == "taken"]
    assert set(taken) == set(run.exposures)
    assert len(taken) == len(run.exposures)


def check_goes_on(rig: Rig, count: int) -> None:
    """Without faults the run that was stopped becomes complete."""
    rig.controller.fault = lambda number, line: None
    rig.controller.on_line = lambda number: None
    rig.controller.run_at(FAST)
    assert tbcad(rig.resume()) == 0
    check_every_photograph(rig.out, count)


def journal(folder: Path) -> list[dict[str, Any]]:
    lines = (folder / "journal.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def events(folder: Path) -> list[str]:
    return [line["event"] for line in journal(folder)]


def content(folder: Path) -> dict[str, Any]:
    """A run's folder but for times and journal."""
    found: dict[str, Any] = {}
    for path in (folder / "run.json", *(folder / "photographs").iterdir()):
        if path.suffix == ".json":
            value = json.loads(path.read_text())
            found[path.name] = {key: value[key] for key in value if key not in TIMES}
        else:
            found[path.name] = path.read_bytes()
    return found


def killed_run(rig: Rig, camera: str, stops: int, kills: int, seed: int) -> None:
    """Start, kill at random moments, and go on until the end."""
    random = np.random.default_rng(seed)
    each = PER_STOP * stops // kills * PHOTOGRAPH  # lines, so that all kills come in time
    words = rig.words(camera=camera, stops=f"1-{stops}")
    for lines in random.integers(1, rig.controller.lines_before + each, kills).tolist():
        kill_after(rig, words, lines, random.uniform(0, DELAY_S))
        if (rig.out / "run.json").is_file():
            words = rig.words("--resume", camera=camera, stops=None)
    process = rig.start(words)
    _, err = process.communicate(timeout=600)
    assert process.returncode == 0, err


def kill_after(rig: Rig, words: list[str], lines: int, delay_s: float) -> None:
    """Kill a command a moment after its controller has some lines."""
    end, process = len(rig.controller.lines) + lines, rig.start(words)

    def kill(number: int) -> None:
        if number == end:
            Timer(delay_s, process.kill).start()

    rig.controller.on_line = kill
    output = process.communicate(timeout=600)
    rig.controller.on_line = lambda number: None
    assert process.returncode == -signal.SIGKILL, output

"""Write docs/pictures/loop-*.png: photographs of a run, their merge, and views of three merges.

tbcad simulate-run exports/ --process fdm --seed 3 --out runs/fdm3
tbcad calibrate runs/fdm3 --exports exports/ --out calibration/
python docs/loop_pictures.py exports/ runs/fdm3 calibration/

SSIM is printed too: docs/from-photographs-to-views.md has it.
"""

import csv
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image
from scipy.ndimage import maximum_filter

import tbcad
from tbcad.common.figure_files import srgb
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.lamps import lit_by, read_lamps
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.light.simulate.views.viewpoints import BY_NEAREST, Viewpoints, pinhole_targets
from tbcad.rig.machine.designed import designed_prototype
from tbcad.rig.machine.machine import RECORD, read_machine, write_machine
from tbcad.rig.simulated_run.simulate import run_object
from tbcad.types import Bytes

PICTURES = Path(__file__).parent / "pictures"
PHOTOGRAPH = "a_0040"
PART = np.s_[:1040, 60:1300]  # rows and columns that show balls
BAR_PX, MOST = 200, 100  # length of the bar; levels at the end of the scale
SIZE, CUT = (400, 300), np.s_[60:240, 90:310]
VIEWPOINTS = Viewpoints(np.repeat((25.0, 60.0), 3), np.tile((20.0, 140.0, 250.0), 2), 640.0)


def encoded(picture: Bytes) -> Bytes:
    """Linear numbers (h, w, ...) as a display wants them (sRGB)."""
    return np.asarray(np.rint(255 * srgb(picture / 255.0)), dtype=np.uint8)


def photographs(run: Path, calibration: Path) -> None:
    """One stop lit, and by LED 1 with rings about the highlights that the calibration used."""
    with (calibration / "residuals.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["photograph"] == f"{PHOTOGRAPH}_led_1"]
    figure, both = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
    titles = {"lit": "lit", "led_1": "by LED 1: highlights by the number of their ball"}
    for axes, (phase, title) in zip(both, titles.items(), strict=True):
        picture = np.asarray(Image.open(run / "photographs" / f"{PHOTOGRAPH}_{phase}.png"))
        axes.imshow(maximum_filter(encoded(picture), (4, 4, 1))[PART])  # else spots are too small
        axes.set_title(title, fontsize=11)
        axes.set_axis_off()
        axes.plot([40, 40 + BAR_PX], [1000, 1000], color="white", linewidth=3)
        axes.text(40, 980, f"{BAR_PX} px", color="white", fontsize=9)
    for row in (row for row in rows if row["used"] == "1"):
        at = float(row["column_px"]) - PART[1].start, float(row["row_px"])
        both[1].plot(*at, "o", markersize=11, fillstyle="none", color="#E69F00")
        both[1].text(at[0] + 20, at[1] - 12, row["ball"], color="#E69F00", fontsize=9)
    figure.savefig(PICTURES / "loop-photographs.png", dpi=110)


def merged(folder: Path) -> None:
    """The merged picture of camera a."""
    picture = Image.fromarray(encoded(np.asarray(Image.open(folder / "camera_a.png"))))
    small = picture.resize((picture.width // 2, picture.height // 2), Image.Resampling.BOX)
    small.save(PICTURES / "loop-merged.png", optimize=True)


def views(scene: Scene, sources: dict[str, LightField]) -> None:
    """Views of the first place, their differences from the truth, and SSIM of all places."""
    capture_mm = next(iter(sources.values())).capture_mm
    targets = pinhole_targets(scene, VIEWPOINTS.cameras(capture_mm, SIZE))
    figure, axes = plt.subplots(2, 4, figsize=(12, 5.4), layout="constrained")
    axes[0, 0].imshow(encoded(targets.truths[0])[CUT])
    axes[0, 0].set_title("ground truth", fontsize=11)
    for column, (name, source) in enumerate(sources.items(), 1):
        view = BY_NEAREST.views(source)
        ssim = targets.quality(view, lambda _: None)["ssim"].mean()
        print(f"{name}: SSIM {ssim:.3f}", flush=True)
        picture = view(targets.cameras[0])
        axes[0, column].imshow(encoded(picture)[CUT])
        axes[0, column].set_title(f"{name}\nSSIM of six views {ssim:.3f}", fontsize=11)
        apart = np.abs(picture.astype(float) - targets.truths[0]).mean(axis=2)[CUT]
        image = axes[1, column].imshow(apart, vmin=0, vmax=MOST)
        axes[1, column].set_title("difference from the truth", fontsize=10)
    for one in axes.flat:
        one.set_axis_off()
    figure.colorbar(image, ax=axes[1].tolist(), label="levels of 255", extend="max")
    figure.savefig(PICTURES / "loop-views.png", dpi=110)


def main(build: Path, run: Path, calibration: Path) -> None:
    """Write the three pictures."""
    photographs(run, calibration)
    export, truth = read_export(build), read_machine(run / "truth.json")
    lamps, subject = read_lamps(build), run_object(export, None)
    scene = prepared_scene(lit_by(lamps, subject) if lamps else subject)
    with tempfile.TemporaryDirectory() as temp:
        known, drawn = Path(temp) / "known", Path(temp) / "drawn"
        machines = {known: truth[0], drawn: designed_prototype(export, read_plan(export))}
        for folder, machine in machines.items():
            folder.mkdir()
            write_machine(folder / RECORD, machine, truth[1])
        merges = {
            "machine known exactly": known,
            "as calibrated": calibration,
            "by the drawing": drawn,
        }
        sources = {}
        for name, folder in merges.items():
            tbcad.merge(run, folder, build, out=Path(temp) / name)
            sources[name] = LightField.read(Path(temp) / name)
        merged(Path(temp) / "as calibrated")
        views(scene, sources)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit("usage: python docs/loop_pictures.py BUILD RUN CALIBRATION")
    main(*map(Path, sys.argv[1:]))

"""Write docs/pictures/real-optics.png: a photograph by tbcad, Mitsuba and Blender, and differences.

    python docs/real_picture.py

Theirs are those that tests/clients/render_real.py has rendered.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from tbcad.light.simulate.scene.rays import exact_tracer

sys.path.insert(0, str(Path(__file__).parents[1]))  # tests/ is not installed
from tests.clients.real_machine import CROP, ROUGHNESS, compared, kept, machine, our_light

PICTURE = Path(__file__).parent / "pictures" / "real-optics.png"
PART = np.s_[225:425, 40:340]  # rows and columns of those that are kept
BAR_PX, MOST = 50, 40  # length of the bar; levels at the ends of the scale


def mm_a_pixel() -> float:
    """What a pixel is at the object, in the median of those that show it here, mm."""
    left, top, columns, rows = CROP
    rays = exact_tracer(machine().reflector)(range(top, top + rows), (0.0, 0.0))
    along = (rays.origin * rays.direction).sum(axis=2, keepdims=True)
    nearest = (rays.origin - along * rays.direction)[:, left : left + columns]
    step = np.linalg.norm(np.diff(nearest, axis=1), axis=2)[PART]
    shown = (compared()[:, 1:] > 0) & (compared()[:, 1:] == compared()[:, :-1])
    return float(np.median(step[shown[PART][:, : step.shape[1]]]))


def main() -> None:
    """Write the picture."""
    ours = our_light(machine().subject, machine().lamps, ROUGHNESS)
    shown = np.where(compared()[..., None] > 0, ours, 0)
    theirs = {
        name: kept(f"{name.lower()}_matt") + kept(f"{name.lower()}_gloss")[..., None]
        for name in ("Mitsuba", "Blender")
    }
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.3), layout="constrained")
    pictures = {"tbcad, 4 rays a pixel": shown} | {
        f"{name}, 96 rays a pixel": one for name, one in theirs.items()
    }
    for axis, (name, picture) in zip(axes[0], pictures.items(), strict=True):
        axis.imshow(np.clip(picture[PART], 0, 255).astype(np.uint8), interpolation="nearest")
        axis.set_title(name, fontsize=10)
    bar = axes[0, 0]
    bar.plot([10, 10 + BAR_PX], [190, 190], color="white", linewidth=3)
    text = f"{BAR_PX} px, {BAR_PX * mm_a_pixel():.0f} mm at the object"
    bar.text(10, 184, text, color="white", fontsize=8)
    apart = [(f"tbcad - {name}", shown - one) for name, one in theirs.items()]
    apart.append(("Mitsuba - Blender", theirs["Mitsuba"] - theirs["Blender"]))
    for axis, (name, one) in zip(axes[1], apart, strict=True):
        mean = one[PART].mean(axis=2)
        image = axis.imshow(mean, cmap="PuOr", vmin=-MOST, vmax=MOST, interpolation="nearest")
        axis.set_title(name, fontsize=10)
    figure.colorbar(image, ax=axes[1].tolist(), label="levels of 255", extend="both")
    for axis in axes.flat:
        axis.set_axis_off()
    figure.savefig(PICTURE, dpi=110)


if __name__ == "__main__":
    main()

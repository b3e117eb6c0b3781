"""Pictures of the steps of assembly: new parts apart from their places, with call-outs.

Run as a program, as `shell_pictures`: `python -m tbcad.report.assembly_pictures DIR PICTURES`.
"""

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pyvista
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import distance_transform_edt

from tbcad.cad.drafting.callouts import RADIUS, Callout, Placed, place_callouts
from tbcad.cad.drafting.callouts import SMALL as QUANTITY
from tbcad.core.geometry.vectors import unit
from tbcad.prototype.assembly_steps.exploded import offsets
from tbcad.prototype.assembly_steps.machine import AssembledMachine, read_machine
from tbcad.prototype.assembly_steps.steps import Step, assembly_steps
from tbcad.prototype.assembly_steps.views import best_eye
from tbcad.report.page.bodies import prototype_bodies
from tbcad.report.prototype_pictures import surface
from tbcad.types import Bytes, Floats, Ints

SIZE, SMALL = (1500, 950), (375, 238)
ANGLE_DEG, AMBIENT = 25.0, 0.2
FILLED = (0.66, 0.84)  # largest shares of the picture's width and height that new parts take
CONTEXT = 0.45  # share of all that is shown, at least, that a picture has room for
NEW, FASTENER, THERE = "#7fb0ea", "#ee7f2d", "#c4c4c4"
SQUARE_WORTH = 0.9  # of directions along x or y: shades tell more than lines
ANCHOR_PX = 12  # visible pixels that a call-out needs
DIGIT, SHADES = 8, 32  # of colours that number bodies
FONT, DOT, LINE, HALO = 26, 5, 3, 7
INK, PAPER = "#111111", "#ffffff"


class _Scene:
    """The bodies of a step, to be drawn shaded or in colours that number them."""

    def __init__(self, meshes: Mapping[str, pyvista.PolyData], new: frozenset[str]) -> None:
        self.names, self.new = sorted(meshes), new
        self.meshes = meshes

    def plotter(self, size: tuple[int, int]) -> pyvista.Plotter:
        plotter = pyvista.Plotter(off_screen=True, window_size=size)
        plotter.set_background("white")
        return plotter

    def numbered(self, size: tuple[int, int]) -> pyvista.Plotter:
        """Each body in the colour of its number from 1, without light."""
        plotter = self.plotter(size)
        plotter.set_background("black")
        plotter.disable_anti_aliasing()  # blended colours would be other numbers
        plotter.render_window.SetMultiSamples(0)
        for number, name in enumerate(self.names, 1):
            digits = (number // DIGIT**2, number // DIGIT % DIGIT, number % DIGIT)
            colour = [SHADES * digit / 255 for digit in digits]
            plotter.add_mesh(self.meshes[name], color=colour, lighting=False)
        return plotter

    def shaded(self, fasteners: frozenset[str]) -> pyvista.Plotter:
        plotter = self.plotter(SIZE)
        for name in self.names:
            new = FASTENER if name in fasteners else NEW
            colour = new if name in self.new else THERE
            plotter.add_mesh(self.meshes[name], color=colour, ambient=AMBIENT, specular=0.1)
        plotter.enable_anti_aliasing("ssaa")
        return plotter

    def _reach(self, names: Iterable[str], axes: Floats) -> tuple[Floats, Floats]:
        """Least and greatest coordinates of bodies along axes."""
        points = np.vstack([self.meshes[name].points for name in sorted(names)]) @ axes.T
        return points.min(axis=0), points.max(axis=0)

    def look(self, plotter: pyvista.Plotter, eye: Floats) -> None:
        """Look from a direction at the new bodies."""
        right = unit(np.cross([0.0, 0.0, 1.0], eye))
        axes = np.stack([right, np.cross(eye, right), eye])
        low, high = self._reach(self.new, axes)
        least, most = self._reach(self.meshes.keys(), axes)
        half = np.maximum(high - low, CONTEXT * (most - least)) / 2
        focus, half, away = (low + high) / 2 @ axes, half[:2], half[2]
        ratio = np.array([SIZE[0] / SIZE[1] * FILLED[0], FILLED[1]])
        distance = (half / ratio).max() / np.tan(np.radians(ANGLE_DEG) / 2) + away
        plotter.camera_position = [tuple(focus + distance * eye), tuple(focus), (0.0, 0.0, 1.0)]
        plotter.camera.view_angle = ANGLE_DEG
        plotter.reset_camera_clipping_range()


def draw(folder: Path, pictures: Path) -> None:
    """Draw a PNG file for each step that has bodies, named by its key, into a folder."""
    machine = read_machine(folder)
    bodies = {one.name: surface(one.vertices, one.triangles) for one in prototype_bodies(folder)}
    for tool in machine.record.with_role("tool"):  # which are not in the assembly: on the bed
        mesh = pyvista.read(folder / tool.stl)
        points = np.asarray(mesh.points, dtype=np.float64) - tool.origin_mm
        bodies[tool.name] = surface(points @ np.array(tool.axes).T, mesh.regular_faces)
    for step in assembly_steps(machine):
        if new := {name for use in step.parts for name in use.bodies} & bodies.keys():
            _picture(machine, step, bodies, frozenset(new)).save(pictures / f"{step.key}.png")


def _picture(
    machine: AssembledMachine,
    step: Step,
    bodies: Mapping[str, pyvista.PolyData],
    new: frozenset[str],
) -> Image.Image:
    moved = offsets(machine, new)
    shown = {
        name: bodies[name].translate(moved.get(name, np.zeros(3)), inplace=False)
        for name in (*new, *step.near)
        if name in bodies
    }
    scene = _Scene(shown, new)
    eye = _best_eye(scene, step)
    fasteners = frozenset(one.name for one in machine.fasteners)
    picture = Image.fromarray(_screenshot(scene, scene.shaded(fasteners), eye))
    numbers = _numbers(_screenshot(scene, scene.numbered(SIZE), eye))
    callouts = list(_callouts(step, scene, numbers))
    draw_callouts(picture, place_callouts(callouts, SIZE))
    return picture.quantize(255, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)


def _screenshot(scene: _Scene, plotter: pyvista.Plotter, eye: Floats) -> Bytes:
    scene.look(plotter, eye)
    pixels = np.array(plotter.screenshot(None, return_img=True))
    plotter.close()
    return pixels


def _numbers(pixels: Bytes) -> Ints:
    """Numbers of the bodies from their colours, (height, width); 0 where there is none."""
    shades = pixels[..., :3].astype(np.int64)
    digits = (shades + SHADES // 2) // SHADES
    exact = (np.abs(shades - SHADES * digits) <= 1).all(axis=-1)
    return np.asarray(np.where(exact, digits @ np.array([DIGIT**2, DIGIT, 1]), 0))


def _best_eye(scene: _Scene, step: Step) -> Floats:
    """The direction from which most kinds of new parts are seen."""
    plotter = scene.numbered(SMALL)

    def seen(eye: Floats) -> list[int]:
        scene.look(plotter, eye)
        plotter.render()  # what was drawn before is shown otherwise
        numbers = _numbers(np.array(plotter.screenshot(None, return_img=True)))
        pixels = _visible(scene, numbers)
        # Of the best seen body of each kind of part.
        return [max((pixels.get(n, 0) for n in use.bodies), default=0) for use in step.parts]

    eye = best_eye(seen, SQUARE_WORTH)
    plotter.close()
    return eye


def _visible(scene: _Scene, numbers: Ints) -> dict[str, int]:
    """Visible pixels of each body."""
    counts = np.bincount(numbers.ravel(), minlength=len(scene.names) + 1)
    return dict(zip(scene.names, counts[1:].tolist(), strict=False))


def _callouts(step: Step, scene: _Scene, numbers: Ints) -> Iterable[Callout]:
    """A call-out for each kind of part that is seen, at the middle of its best seen body."""
    pixels = _visible(scene, numbers)
    for use in step.parts:
        best = max(use.bodies, key=lambda name: pixels.get(name, 0), default="")
        if pixels.get(best, 0) >= ANCHOR_PX:
            yield Callout(use.item, use.quantity, _inside(numbers == scene.names.index(best) + 1))


def _inside(mask: Sequence[bool] | Floats) -> tuple[float, float]:
    """The pixel (x, y) of a region that is farthest from its edge."""
    y, x = np.unravel_index(int(np.argmax(distance_transform_edt(mask))), np.shape(mask))
    return float(x), float(y)


def draw_callouts(picture: Image.Image, placed: Sequence[Placed]) -> None:
    """Draw lines, dots, circles and numbers."""
    pen = ImageDraw.Draw(picture)
    for colour, width, dot in ((PAPER, HALO, DOT + 2), (INK, LINE, DOT)):
        for one in placed:
            pen.line([one.middle, one.callout.anchor], fill=colour, width=width)
            pen.circle(one.callout.anchor, dot, fill=colour)
    for one in placed:
        _number(pen, one, picture.width)


def _number(pen: ImageDraw.ImageDraw, one: Placed, width: int) -> None:
    x, y = one.middle
    pen.circle((x, y), RADIUS, fill=PAPER, outline=INK, width=LINE)
    pen.text((x, y), str(one.callout.number), INK, ImageFont.load_default(FONT), anchor="mm")
    if one.callout.quantity > 1:
        below = (x, y + RADIUS + 2)
        font = ImageFont.load_default(QUANTITY)
        pen.text(
            below, f"x {one.callout.quantity}", INK, font, "mt", stroke_width=3, stroke_fill=PAPER
        )


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))

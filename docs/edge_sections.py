"""Draw docs/pictures/edge-sections.svg: the median valley of a shell, and its mandrel's ridge.

Run: python docs/edge_sections.py BUILD, with a folder of `tbcad build turtleback-nickel`.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.light.simulate.scene.reflector import Reflector, read_export
from tbcad.tolerancing.montecarlo.coverage import coverage
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors

OUT = Path(__file__).parent / "pictures" / "edge-sections.svg"
LOOKS = list(plt.cycler(ec=("#009e73", "#d55e00", "#0072b2"), ls=(":", "--", "-")))  # Okabe, Ito
CUTTERS, RIDGE_CUTTERS, ROUNDINGS = (0.5, 0.25, 0.1), (2.0, 0.5), (0.03, 0.002)  # radii, mm


def median_edge(at: Reflector) -> tuple[np.ndarray, np.ndarray]:
    """Normals (2, 2) of both mirrors at the median edge, the light above, and radii (2, 1), mm."""
    arcs, m = at.cells.arcs, len(at)
    between = np.flatnonzero((arcs.left < m) & (arcs.right < m))
    both = np.stack([arcs.left[between], arcs.right[between]])
    radius = 1 / at.mirrors.curvature
    centre = at.mirrors.apex - radius[:, None] * at.mirrors.normal
    slope = np.arccos(dot(*unit(arcs.at(between, np.full(len(between), 0.5)) - centre[both]))) / 2
    k = np.argsort(slope)[len(slope) // 2]
    sine, cosine = np.sin(slope[k]), np.cos(slope[k])
    return np.array([[sine, cosine], [-sine, cosine]]), radius[both[:, [k]]]


def fillet(centre: np.ndarray, radii: np.ndarray, ball: float) -> tuple[np.ndarray, np.ndarray]:
    """Centre (2,) of a ball above both mirrors' circles, and where it touches them, (2, 2), mm."""
    along, (one, other) = centre[1] - centre[0], radii.ravel() + ball
    share = (1 + (one**2 - other**2) / dot(along, along)) / 2
    up = np.sqrt(one**2 / dot(along, along) - share**2) * np.array([-along[1], along[0]])
    middle = centre[0] + share * along + up
    return middle, middle + ball * unit(centre - middle)


def coverage_lost(models: EdgeModels, ball: float) -> float:
    """By how much fillets of a radius make the minimum coverage smaller, mm."""
    errors = (Errors(cutter_radius=Error(0.0, one)) for one in (0.0, ball))
    least = [coverage(models, draw(one, 1, range(1), len(models[0])))[0].min() for one in errors]
    return float(least[0] - least[1])


def main(folder: Path) -> None:
    """Write the picture."""
    plt.rcParams.update({"svg.hashsalt": "tbcad", "svg.fonttype": "path", "font.size": 9})
    figure, grid = plt.subplots(2, 2, figsize=(8, 6.6), layout="constrained", height_ratios=(3, 1))
    reflectors = read_export(folder).reflectors
    normal, radii = median_edge(reflectors[0])
    centre, models = -radii * normal, edge_models(reflectors)
    circles = []  # place in the grid, centre, radius, text
    for column, balls in enumerate((CUTTERS, ROUNDINGS)):
        for ball in balls:
            middle, ends = fillet(centre, radii, ball)
            size = f"{1e3 * norm(ends[1] - ends[0]):.3g} wide, {1e3 * (middle[1] - ball):.2g} deep"
            text = f"{1e3 * ball:g} µm: {size}, {coverage_lost(models, ball):.2f} mm lost"
            circles += [((1, column), middle * [1, 1 - 2 * column], ball, text)]
            circles += [((0, 0), middle, ball, f"cutter of {ball:g} mm")] * (column == 0)
    for ball in RIDGE_CUTTERS:
        for one, text in zip(normal, (f"cutter of {ball:g} mm, both sides", ""), strict=True):
            circles += [((0, 1), ball * one * [-1, 1], ball, text)]
    for (row, column), half, low, high, title in (
        ((0, 0), 0.8, -0.2, 1.1, "Shell: a valley (mm)"),
        ((0, 1), 3.2, -1.0, 4.2, "Its mandrel: the same edge, a ridge (mm)"),
        ((1, 0), 0.13, -0.015, 0.04, "Fillets, enlarged (µm); coverage lost"),
        ((1, 1), 0.012, -0.0036, 0.0015, "Rounded ridge, enlarged (µm); coverage lost"),
    ):
        axes, x = grid[row, column], np.linspace(-half, half, 801)
        side = (x > 0).astype(int)
        y = centre[side, 1] + np.sqrt(radii[side, 0] ** 2 - (x - centre[side, 0]) ** 2)
        axes.fill_between(x, y * (1 - 2 * column), low, color="#dddddd", lw=0)
        axes.plot(x, y * (1 - 2 * column), color="#333333", lw=1)
        here = [one[1:] for one in circles if one[0] == (row, column)]
        look = dict(zip(sorted({ball for _, ball, _ in here}), LOOKS, strict=False))
        for middle, ball, text in here:
            axes.add_patch(plt.Circle(middle, ball, fill=False, zorder=3, label=text, **look[ball]))
        axes.set(xlim=(-half, half), ylim=(low, high), aspect="equal", title=title)
        axes.locator_params(nbins=5)
        for axis in (axes.xaxis, axes.yaxis) if row else ():
            axis.set_major_formatter(lambda value, _: f"{1e3 * value:g}")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08 - 0.2 * row), frameon=False)
    figure.savefig(OUT, metadata={"Date": None})


if __name__ == "__main__":
    main(Path(sys.argv[1]))

"""Plots of a calibration: residuals, their distribution, spheres, and rays."""

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from tbcad.common.figure_files import PlotFormat, figure_file, legend_below
from tbcad.common.results import PlotPanel, Series, plot_file
from tbcad.core.geometry.vectors import norm
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.report.recovered import SIGMAS, Kind
from tbcad.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INCHES = (7.0, 5.2)
MOST_ARROWS = 2000
ARROW_SHARE = 0.04  # of the picture's width, for a residual of the root mean square
RANGE = 5.0  # standard deviations, of the histogram
BINS = 60
ELLIPSE_POINTS = 60
ELLIPSE_SIGMAS = 2.0
ENLARGED = 0.15  # of the spheres' distance, for the largest shift
COLUMNS = 4
PANEL_INCHES = 2.6  # width and height of a panel
PANEL_RANGE, PANEL_BINS = 4.0, 32  # of the histogram, in standard deviations
TITLE_LINE = 26  # letters


def plots(
    result: MachineCalibration, spheres: Floats, kind: PlotFormat = "svg"
) -> dict[str, bytes]:
    """All plots by the names of their files; covariances of spheres in mm^2, (k, 4, 4)."""
    drawn = {
        "residuals": lambda figure: _residual_arrows(figure, result),
        "spheres": lambda figure: _shifts(figure, result, spheres),
    }
    panels = {"residual_distribution": _distribution_panel(result), "rays": _rays_panel(result)}
    files = {name: figure_file(draw, INCHES, kind) for name, draw in drawn.items()}
    files |= {name: plot_file((panel,), kind) for name, panel in panels.items()}
    return {f"{name}.{kind}": data for name, data in files.items()}


def _residual_arrows(figure: "Figure", result: MachineCalibration) -> None:
    """Where in the picture highlights are off, and which way."""
    found, camera = result.found, result.setup.designed.camera
    axes = figure.add_subplot()
    every = max(1, len(found.highlights) // MOST_ARROWS)
    size = np.sqrt((found.residual[found.used] ** 2).sum(axis=1).mean())
    scale = float(size) / (ARROW_SHARE * camera.width_px)
    style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "width": 0.0018, "scale": scale}
    used, left_out = np.flatnonzero(found.used)[::every], np.flatnonzero(~found.used)
    arrows = axes.quiver(
        *found.highlights.pixel[used].T, *found.residual[used].T, label="used", color="C0", **style
    )
    axes.quiverkey(arrows, 0.8, 1.03, float(size), f"{size:.3f} px", labelpos="E")
    if len(left_out):
        off = 2 * size * found.residual[left_out] / norm(found.residual[left_out])[:, None]
        label = "outliers, direction only"
        axes.quiver(*found.highlights.pixel[left_out].T, *off.T, label=label, color="C1", **style)
    axes.set(xlim=(0, camera.width_px), ylim=(camera.height_px, 0), aspect="equal")
    axes.set(title="Residuals of highlights", xlabel="column, px", ylabel="row, px")
    legend_below(axes)


def _distribution_panel(result: MachineCalibration) -> PlotPanel:
    """Residuals in standard deviations, next to the normal law."""
    found = result.found
    off = (found.residual / (found.highlights.sigma * found.noise_factor)[:, None])[found.used]
    edges, x = np.linspace(-RANGE, RANGE, BINS + 1), np.linspace(-RANGE, RANGE, 400)
    lines = [Series("normal law", x, np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi), "k--")]
    for column, name in enumerate(("columns", "rows")):
        density, _ = np.histogram(off[:, column], edges, density=True)
        lines.append(Series(name, np.repeat(edges, 2)[1:-1], np.repeat(density, 2), f"C{column}-"))
    title = f"Residuals of {int(found.used.sum())} highlights"
    return PlotPanel(title, "residual, standard deviations", "density", tuple(lines), "y")


def _shifts(figure: "Figure", result: MachineCalibration, spheres: Floats) -> None:
    """Spheres on the base along its axis, with enlarged shifts and error ellipses."""
    prior = result.found.prior
    designed = result.setup.designed.centre @ prior.across.T
    shift = (result.found.machine.centre - result.setup.designed.centre) @ prior.across.T
    flat = prior.across @ spheres[:, :3, :3] @ prior.across.T
    largest = float(np.linalg.norm(shift, axis=1).max())
    factor = ENLARGED * float(np.linalg.norm(designed, axis=1).max()) / max(largest, 1e-9)
    axes = figure.add_subplot()
    axes.plot(*designed.T, "k+", label="designed")
    for k, (place, moved, one) in enumerate(zip(designed, shift, flat, strict=True)):
        end = place + factor * moved
        ring = end[:, None] + factor * ELLIPSE_SIGMAS * _ellipse(one)
        axes.plot(*np.stack([place, end]).T, "C0-", lw=1, label="shift" if k == 0 else None)
        axes.plot(*ring, "C1-", lw=1, label=f"{ELLIPSE_SIGMAS:g} sigma" if k == 0 else None)
        axes.annotate(str(k + 1), place, xytext=(4, 4), textcoords="offset points", fontsize=7)
    axes.set_aspect("equal")
    axes.set(
        title=f"Centres along the axis; shifts and ellipses x {factor:.0f}, longest "
        f"{1000 * largest:.0f} um",
        xlabel="first direction across the axis, mm",
        ylabel="second direction, mm",
    )
    legend_below(axes)
    axes.grid(True, alpha=0.25)


def _ellipse(covariance: Floats) -> Floats:
    """Points (2, n) of the ellipse of one standard deviation."""
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0, 2 * np.pi, ELLIPSE_POINTS)
    ring = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray(vectors @ (np.sqrt(np.maximum(values, 0))[:, None] * ring))


def _rays_panel(result: MachineCalibration) -> PlotPanel:
    """How well rays are known over the hemisphere, the zenith in the middle."""
    known = result.rays.known
    turned = np.array([result.setup.frames[i].object_turn_deg for i in known.frame]) == 180
    way = -known.direction * np.where(turned[:, None], HALF_TURN, np.ones(3))
    from_zenith = np.degrees(np.arccos(np.clip(way[:, 2], -1, 1)))
    level = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)
    x, y = (from_zenith[:, None] * way[:, :2] / level[:, None]).T
    label = "standard deviation at the object's centre, mm"
    points = Series("", x, y, shade=known.relative.place_mm, shade_label=label)
    toward = "degrees from the zenith, toward"
    title = "Rays of virtual cameras, the zenith in the middle"
    return PlotPanel(title, f"{toward} x", f"{toward} y", (points,))


def draw_recovered(figure: "Figure", kinds: tuple[Kind, ...]) -> None:
    """One panel a kind, and one of all errors in standard deviations; sets the figure's size."""
    rows = -(-(len(kinds) + 1) // COLUMNS)
    figure.set_size_inches(PANEL_INCHES * COLUMNS, PANEL_INCHES * rows)
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, kind in zip(panels, kinds, strict=False):
        _panel(axes, kind)
    _distribution(panels[len(kinds)], kinds)
    for axes in panels[len(kinds) + 1 :]:
        axes.set_visible(False)


def _panel(axes: "Axes", kind: Kind) -> None:
    both = np.concatenate([kind.injected, kind.recovered])
    low, high = float(both.min()), float(both.max())
    axes.plot([low, high], [low, high], "k-", lw=0.6, alpha=0.6)
    axes.errorbar(
        kind.injected,
        kind.recovered,
        yerr=SIGMAS * kind.sigma,
        fmt="C0o",
        ecolor="C1",
        ms=2,
        elinewidth=0.8,
        label=kind.name,
    )
    axes.set_title(textwrap.fill(f"{kind.name}, {kind.unit}", TITLE_LINE), fontsize=7)
    axes.set_xlabel("injected", fontsize=7)
    axes.set_ylabel("recovered", fontsize=7)
    axes.tick_params(labelsize=6)
    text = f"{len(kind.sigma)} figures\n{kind.within:.0%} within {SIGMAS:g} sigma"
    axes.text(0.04, 0.96, text, transform=axes.transAxes, va="top", fontsize=6)
    axes.grid(True, alpha=0.25)


def _distribution(axes: "Axes", kinds: tuple[Kind, ...]) -> None:
    """All errors in their standard deviations next to the normal law, each kind alike."""
    off = np.concatenate([kind.sigmas_off for kind in kinds])
    weight = np.concatenate([np.full(len(k.sigma), 1 / len(k.sigma)) for k in kinds])
    edges = np.linspace(-PANEL_RANGE, PANEL_RANGE, PANEL_BINS + 1).tolist()
    axes.hist(
        np.clip(off, -PANEL_RANGE, PANEL_RANGE), edges, density=True, weights=weight, color="C0"
    )
    x = np.linspace(-PANEL_RANGE, PANEL_RANGE, 200)
    axes.plot(x, np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi), "k--", lw=1)
    axes.set_xlabel("error, standard deviations", fontsize=7)
    axes.set_ylabel("density", fontsize=7)
    axes.set_title("errors over their deviations,\neach kind alike; normal law", fontsize=7)
    axes.tick_params(labelsize=6)
    axes.grid(True, alpha=0.25)

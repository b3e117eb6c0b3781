"""Plot of recovered against injected errors of a simulated build."""

from typing import TYPE_CHECKING

import numpy as np

from tbcad.calibration.report.recovered import SIGMAS, Kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 4
INCHES = 2.6  # width and height of a panel
RANGE, BINS = 4.0, 32  # of the histogram, in standard deviations
TITLE_LINE = 26  # letters


def draw_recovered(figure: "Figure", kinds: tuple[Kind, ...]) -> None:
    """One panel a kind, and one of all errors in standard deviations; sets the figure's size."""
    rows = -(-(len(kinds) + 1) // COLUMNS)
    figure.set_size_inches(INCHES * COLUMNS, INCHES * rows)
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
    axes.set_title(_wrapped(f"{kind.name}, {kind.unit}"), fontsize=7)
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
    edges = np.linspace(-RANGE, RANGE, BINS + 1).tolist()
    axes.hist(np.clip(off, -RANGE, RANGE), edges, density=True, weights=weight, color="C0")
    x = np.linspace(-RANGE, RANGE, 200)
    axes.plot(x, np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi), "k--", lw=1)
    axes.set_xlabel("error, standard deviations", fontsize=7)
    axes.set_ylabel("density", fontsize=7)
    axes.set_title("errors over their deviations,\neach kind alike; normal law", fontsize=7)
    axes.tick_params(labelsize=6)
    axes.grid(True, alpha=0.25)


def _wrapped(title: str) -> str:
    if len(title) <= TITLE_LINE:
        return title
    middle = title.rfind(" ", 0, TITLE_LINE)
    return f"{title[:middle]}\n{title[middle + 1 :]}"

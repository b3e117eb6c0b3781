"""Draw docs/pictures/principle.svg: the optics of the paper's design in the plane y = 0.

Run: python docs/principle.py. Everything drawn is of the design itself: poses, radii and rays.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

import tbcad
from tbcad.core.mirrors.array import MirrorArray

OUT = Path(__file__).parent / "pictures" / "principle.svg"
IN_PLANE = 1e-6  # of y of a mirror's direction
SHOWN = 6  # mirror whose rays are drawn, counted from the zenith
CAMERA, MIRROR, OBJECT, VIRTUAL = "#0072b2", "#333333", "#d55e00", "#009e73"
XZ = [0, 2]
SAMPLES = 4001
STYLE = {"svg.hashsalt": "tbcad", "svg.fonttype": "path", "font.size": 9}


def in_plane(array: MirrorArray) -> np.ndarray:
    """Numbers of the mirrors in the plane y = 0, from the zenith to the foot."""
    chosen = np.flatnonzero(np.abs(array.u[:, 1]) < IN_PLANE)
    return chosen[np.argsort(-array.u[chosen, 2])]


def profile(array: MirrorArray, mirror: int, half_angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of a mirror's section on either side of its apex, and their normals, (s, 2) each."""
    centre, normal = array.mirrors.centre[mirror][XZ], array.mirrors.normal[mirror][XZ]
    angle = np.linspace(-half_angle, half_angle, SAMPLES) + np.arctan2(normal[1], normal[0])
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    return centre + array.mirrors.radius[mirror] * normals, normals


def section(array: MirrorArray) -> np.ndarray:
    """What rays from the origin meet first of all mirrors, in the plane y = 0, (s, 2)."""
    ends = np.arctan2(*array.u[in_plane(array)[[0, -1]]][:, [2, 0]].T)
    angle = np.linspace(*ends, 1500)
    ray = np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
    mirrors = np.arange(len(array.u))
    with np.errstate(invalid="ignore"):
        length = np.stack(
            [
                array.mirrors.first_reach(mirrors, np.zeros(3), np.tile(r, (len(mirrors), 1)))
                for r in ray
            ]
        )
    first = np.nanmin(np.where(length > 0, length, np.nan), axis=1)
    return np.asarray(first[:, None] * ray[:, XZ])


def extreme_rays(array: MirrorArray, mirror: int, reach: float) -> list[np.ndarray]:
    """Paths camera -> mirror -> object, (3, 2), of the two rays that touch the capture sphere."""
    camera = array.ellipsoid.pinhole[XZ]
    points, normals = profile(array, mirror, 0.5)
    ray = points - camera
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    out = ray - 2 * (ray * normals).sum(axis=1)[:, None] * normals
    side = points[:, 0] * out[:, 1] - points[:, 1] * out[:, 0]  # signed distance of the origin
    paths = []
    for sign in (-1, 1):
        k = int(np.abs(side - sign * reach).argmin())
        paths.append(np.array([camera, points[k], points[k] - (points[k] @ out[k]) * out[k]]))
    return paths


def enlarge(axes: Axes, array: MirrorArray, mirror: int, reach: float) -> None:
    """An inset round a mirror: the mirrors bulge toward camera and object."""
    apex = array.mirrors.apex[mirror][XZ]
    inset = axes.inset_axes((0.03, 0.66, 0.33, 0.33))
    inset.plot(*section(array).T, color=MIRROR, lw=2)
    for path in extreme_rays(array, mirror, reach):
        inset.plot(*path.T, color=CAMERA, lw=1.0)
    inset.annotate(
        "", apex + 6 * array.mirrors.normal[mirror][XZ], apex, arrowprops={"arrowstyle": "->"}
    )
    inset.set(xlim=apex[0] + [-14, 14], ylim=apex[1] + [-12, 8], aspect="equal")
    inset.set(xticks=[], yticks=[])
    axes.indicate_inset_zoom(inset, edgecolor="#666666")


def draw(axes: Axes, design: "tbcad.Design") -> None:
    """Both arrays, cameras, capture sphere, and one mirror with its rays and virtual camera."""
    reach = design.spec.optics.capture_diameter_mm / 2
    turn = np.linspace(0, 2 * np.pi, 400)
    for array in design.arrays:
        ellipsoid = array.ellipsoid
        camera, axis = ellipsoid.pinhole[XZ], ellipsoid.axis[XZ]
        across = np.array([-axis[1], axis[0]])
        ellipse = (
            camera / 2
            + ellipsoid.semi_major * np.cos(turn)[:, None] * axis
            + ellipsoid.semi_minor * np.sin(turn)[:, None] * across
        )
        axes.plot(*ellipse.T, color="#999999", lw=0.7, ls=(0, (5, 3)))
        axes.plot(*camera, "o", color=CAMERA, ms=6)
        axes.plot(*section(array).T, color=MIRROR, lw=1.6)
    axes.add_patch(plt.Circle((0, 0), reach, fc=OBJECT, ec="none", alpha=0.18))
    axes.add_patch(plt.Circle((0, 0), reach, fc="none", ec=OBJECT, lw=1.2))
    array = design.arrays[0]
    mirror = int(in_plane(array)[SHOWN])
    virtual = 2 * array.ellipsoid.semi_major * array.u[mirror][XZ]
    for path in extreme_rays(array, mirror, reach):
        axes.plot(*path.T, color=CAMERA, lw=1.0)
        axes.plot(*np.array([path[1], virtual]).T, color=VIRTUAL, lw=0.8, ls=":")
    axes.plot(*virtual, "s", color=VIRTUAL, ms=6)
    enlarge(axes, array, mirror, reach)
    label(axes, array, mirror, virtual, reach)


def label(axes: Axes, array: MirrorArray, mirror: int, virtual: np.ndarray, reach: float) -> None:
    """The glossary's words and symbols, off the lines."""
    apex, normal = array.mirrors.apex[mirror][XZ], array.mirrors.normal[mirror][XZ]
    camera = array.ellipsoid.pinhole[XZ]
    axes.annotate("", apex + 32 * normal, apex, arrowprops={"arrowstyle": "->", "lw": 0.9})
    for text, place, shift, colour in (
        ("camera a\n(pinhole, focus)", camera, (-10, -16), CAMERA),
        ("camera b", camera * [-1, 1], (10, -12), CAMERA),
        ("virtual camera V = 2a u", virtual, (-6, 10), VIRTUAL),
        (
            f"capture sphere, {2 * reach:g} mm\n(object; common focus)",
            (0, -reach),
            (0, -18),
            OBJECT,
        ),
        ("P", apex, (8, 6), MIRROR),
        ("N", apex + 32 * normal, (5, 0), MIRROR),
        ("ellipsoid of camera a", (163, -75), (8, 0), "#666666"),
        ("mirrors of camera a", array.mirrors.apex[in_plane(array)[-3]][XZ], (14, 0), MIRROR),
    ):
        axes.annotate(
            text, place, shift, textcoords="offset points", color=colour,
            ha={-1: "right", 0: "center", 1: "left"}[int(np.sign(shift[0]))], va="center",
        )  # fmt: skip


def main() -> None:
    """Write the picture."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(8, 6.2), layout="constrained")
        draw(axes, tbcad.design())
        axes.set(xlabel="x, mm", ylabel="z, mm", aspect="equal", xlim=(-215, 265))
        axes.spines[["top", "right"]].set_visible(False)
        figure.savefig(OUT, metadata={"Date": None})


if __name__ == "__main__":
    main()

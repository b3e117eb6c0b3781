"""Write docs/gallery.md: each design that comes with tbcad, with its figures and a picture.

    python docs/gallery.py                    # all of them: minutes
    python docs/gallery.py afternoon-print    # renews one

Nothing is built: figures are those of `tbcad build NAME --dry-run`, yields those that `tbcad
tolerance` finds for its shells, and the pictures are simulated photographs off the mirrors as
designed. Figures are kept in docs/gallery.json.
"""

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import tbcad
from tbcad.core.mirrors.array import design as mirror_design
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import shipped_designs
from tbcad.light.simulate.capture.light_field import LightField, light_field_in_memory
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.output.overview import Overview, overview
from tbcad.tolerancing.margin import seeing_pixels
from tbcad.tolerancing.montecarlo.builds import CoverageCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.montecarlo.sharpness import view_ssims
from tbcad.tolerancing.process.process import BUILT_IN, load_process, process_errors

DOCS = Path(__file__).parent
RESULTS, PAGE, PICTURES = DOCS / "gallery.json", DOCS / "gallery.md", DOCS / "pictures"
PHOTOGRAPH_PX = (640, 480)
VIEW_DEG = (30.0, 30.0)  # azimuth and elevation
# Simulated by a chain; where fewer than half of the few are good, only these.
BUILDS, FEW = 1000, 50
CAN_BE_MADE = 0.95  # yield
HEAD = """\
# Gallery of designs

The designs that come with tbcad, to begin from one: `tbcad init my.toml --from afternoon-print`.
Other numbers of mirrors: [every subdivision n](every-n.md). Pictures: left, what camera a
photographs of a knot that fills the capture sphere; right, a view from azimuth 30, elevation 30
degrees. With few virtual cameras some of its depth is wrong (specks).

`python docs/gallery.py NAME` renews the figures of a design, which are those of a dry run.
"""

MADE_COLUMNS = ["design", "made by", "yield", "worst camera"]
SSIM = {"SSIM, ideal optics": "ideal", "SSIM, real optics": "real"}
MADE_COLUMNS += ["pixels of a virtual camera", *SSIM]
MADE = """\
## What can be made

*Made by*: the [chains](tolerance.md#chains) with a yield of 95 % or more in 1,000 simulated builds.
Yield and median of the worst virtual cameras are those of the best chain
(`tbcad tolerance exports/ --process nickel-diamond`). `tbcad build NAME --process CHAIN` gives
a design the margins that a chain needs. SSIM is that of four views of the knot by nearest rays;
real optics are the lens that the design requires, shadows, scatter and noise
([0057](decisions/0057-judged-by-real-optics.md)).

{}"""
SHOWN = ("object", "mirrors", "camera", "prototype")


def chains(spec: Spec) -> dict[str, list[float]]:
    """Yield, median of the worst cameras, mm, and number of simulated builds by each chain."""
    if spec.mirrors.radius_rule == "flat":
        return {}
    models, target = edge_models(reflectors(mirror_design(spec))), spec.optics.capture_diameter_mm
    found = {}
    for name in BUILT_IN:
        errors = process_errors(load_process(name), spec.mirrors.coating_um)
        case = CoverageCase(models, errors, 1, worst_only=True)
        worst = simulate(case, FEW).worst
        if np.median(worst) >= target:
            worst = np.append(worst, simulate(case, BUILDS - FEW, first=FEW).worst)
        share, median = float((worst >= target).mean()), float(np.median(worst))
        found[name] = [round(share, 4), round(median, 2), len(worst)]
    return dict(sorted(found.items(), key=lambda item: [-figure for figure in item[1]]))


def figures(found: Overview) -> dict[str, Any]:
    """What the tables show of a design: texts, and the figures of each chain."""
    spec, shells, prototype = found.spec, found.shell_prints, found.prototype
    assert shells is not None
    radius = found.radius_mm
    rows = {
        "object": f"{spec.optics.capture_diameter_mm:g} mm",
        "mirrors": f"{found.mirrors}, n = {spec.optics.n}; {found.virtual_cameras} virtual cameras",
        "radius": "planar" if radius is None else f"{radius[0]:.1f} to {radius[1]:.1f} mm",
        "minimum coverage": f"{found.minimum_coverage_mm:.2f} mm",
        "camera": f"{spec.camera.width_px} x {spec.camera.height_px} pixels, "
        f"{found.view_angle_deg:g} degrees",
        "both shells, by FDM": f"{shells.volume_cm3:.0f} cm3, about {shells.mass_g:.0f} g, "
        f"{shells.hours:.0f} h",
        "pixels of a virtual camera": str(seeing_pixels(spec)),
        **{name: f"{view_ssims({'': spec}, by)['']:.3f}" for name, by in SSIM.items()},
        "prototype": found.note.replace("no prototype", "none").rpartition(":")[0],
    }
    if prototype is not None:
        rows["prototype"] = (
            f"{prototype.balls} ball{'s' * (prototype.balls != 1)} and {prototype.caps} "
            f"cap{'s' * (prototype.caps != 1)}, {prototype.stops} stops; "
            f"{prototype.kept_share:.0%} of the shell's pixels"
        )
    return {name: value for name, value in rows.items() if value} | {"chains": chains(spec)}


def light_field(design: tbcad.Design) -> LightField:
    """Both photographs of a knot that fills the capture sphere."""
    size_mm = design.spec.optics.capture_diameter_mm
    scene = prepared_scene(built_in_object(size_mm))
    taken = [(at, photograph(at.camera, exact_tracer(at), scene)) for at in reflectors(design)]
    return light_field_in_memory(taken, size_mm)


def draw(design: tbcad.Design, name: str) -> None:
    """Write the picture of a design: photograph and view side by side."""
    field = light_field(design)
    photo = Image.fromarray(field.frames["a"].image()).resize(PHOTOGRAPH_PX)
    view = tbcad.view(field, *VIEW_DEG, size=PHOTOGRAPH_PX).image
    both = Image.fromarray(np.concatenate([np.asarray(photo), view], axis=1))
    both.quantize(128).save(PICTURES / f"gallery-{name}.png", optimize=True)


def purpose(name: str) -> str:
    """The first paragraph of a design file's comment."""
    text = shipped_designs()[name].read_text(encoding="utf-8")
    lines = re.match(r"(?:#.*\n)+", text)
    assert lines is not None
    first = re.sub(r"(?m)^# ?", "", lines[0]).split("\n\n")[0]
    return " ".join(first.split())


def good_chains(row: dict[str, Any]) -> list[str]:
    """Chains that make a design, the best first."""
    return [chain for chain, (share, *_) in row["chains"].items() if share >= CAN_BE_MADE]


def order(results: dict[str, Any]) -> list[str]:
    """Names of designs: first those that most chains make, then by the yield of the best chain."""

    def made(name: str) -> tuple[int, float]:
        shares = [share for share, *_ in results[name]["chains"].values()]
        return -len(good_chains(results[name])), -max(shares, default=0)

    return sorted(results, key=made)


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    return "".join(f"| {' | '.join(cells)} |\n" for cells in [head, ["---"] * len(head), *rows])


def design_row(name: str, row: dict[str, Any]) -> list[str]:
    """A design as it is, with the chains that make it and the figures of the best of these."""
    best, (share, covered, _) = next(iter(row["chains"].items()), ("planar mirrors", (0.0, 0.0, 0)))
    return [
        f"[{name}](#{name})",
        ", ".join(good_chains(row)) or f"none ({best})",
        *([f"{100 * share:.3g} %", f"{covered:.2f} of {row['object']}"] if share else ["", ""]),
        row["pixels of a virtual camera"],
        *(row[name] for name in SSIM),
    ]


def can_be_made(results: dict[str, Any]) -> str:
    """Which chain makes which design, and the best one's figures."""
    rows = [design_row(name, results[name]) for name in order(results)]
    return MADE.format(table(MADE_COLUMNS, rows))


def section(name: str, row: dict[str, Any]) -> str:
    """A design's part of the page."""
    lines = "\n".join(f"- {key}: {row[key]}" for key in SHOWN if key in row)
    return (
        f"## {name}\n\n{purpose(name)} [{name}.toml](../designs/{name}.toml)\n\n"
        f"![Photograph of camera a, and a view](pictures/gallery-{name}.png)\n\n"
        f"{lines}\n"
    )


def page(results: dict[str, Any]) -> str:
    """The page of the results."""
    parts = [section(name, results[name]) for name in order(results)]
    return "\n".join([HEAD, can_be_made(results), *parts])


def main(names: list[str]) -> None:
    """Renew these designs, keep the others."""
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for name in names or shipped_designs():
        design = tbcad.design(name)
        results[name] = figures(overview(design, optional_prototype=True))
        draw(design, name)
        RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
        PAGE.write_text(page(results), encoding="utf-8")
        print(name, results[name], flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

"""What calibration can reach by LEDs, noise and process: bounds of Cramer and Rao, no photograph.

Two questions: what four LEDs tell of each sphere alone, all else known; and what a whole run tells
of the whole machine, nothing known but by the process.
"""

from dataclasses import replace

import numpy as np

from tbcad.common.results import Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.geometry.vectors import unit
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.stage.leds import hidden_by_object
from tbcad.rig.calibration.calibrate import Setup, prepared_setup, ray_places
from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes
from tbcad.rig.calibration.estimate.parameters import Block, Prior, prior_of
from tbcad.rig.calibration.led_layout import (
    FREE,
    PRIOR_MM,
    USUAL_PROCESS,
    USUAL_PX,
    Layout,
    layouts,
    mirror_distance,
    ray_errors,
    shell_information,
)
from tbcad.rig.calibration.uncertainty import RayUncertainty, known_rays
from tbcad.rig.machine.machine import Machine
from tbcad.rig.runs import frames_of
from tbcad.tolerancing.process.process import load_process, process_errors
from tbcad.types import Floats, Ints, Progress

NOISES_PX = (0.02, 0.05, 0.1, 0.2)
PROCESSES = ("fdm", "sls", "sla", "cnc")
LARGE_MM = 10.0  # prior standard deviation that tells nothing
ONE_BALL = "free, 50 stops"
STOPS_OF_ONE = 50  # photographs of one ball on its base
SHARES = (50, 95)  # percent of the mirrors
NOTES = (
    "Bounds of Cramer and Rao: no estimate without bias is better. mrad: root mean square angle "
    "between a ray and the true one; mm: root mean square distance at the object's centre; both "
    "median and 95 % of the mirrors.",
    "spheres: camera, axis, angles and LEDs known exactly, one photograph; each sphere alone. "
    "LEDs hidden by an object that fills its room do not count.",
    "machine: all of a run with nothing known but by the process; besides a motion of the whole "
    "machine. Highlights within the picture that the object's room does not hide; shadows of other "
    "balls are not taken off.",
    "best: found by tbcad in pairs half a turn apart, within the stage's room; design: of the "
    "export.",
)


def calibration_study(export: ExportedDesign, progress: Progress) -> Study:
    """The study of a build with a prototype."""
    progress("LEDs that tell most")
    placed = layouts(export, progress)
    progress("spheres alone")
    setup = designed_setup(export)
    alone = _alone_table(setup, placed)
    progress("whole machines")
    whole = _whole_table(setup, placed, progress)
    places = _places_table(placed)
    usual = next(row for row in whole.records() if row["noise_px"] == USUAL_PX)
    figures = tuple(
        Figure("rays after a run, fdm", unit, usual[f"{unit}_50"]) for unit in ("mm", "mrad")
    )
    return Study(
        "calibration", figures, (alone, whole, places), panels(whole, USUAL_PROCESS), NOTES
    )


def _places_table(layouts: list[Layout]) -> Table:
    rows = tuple(
        (layout.name, len(layout.leds), number, *led.tolist())
        for layout in layouts
        for number, led in enumerate(layout.leds, 1)
    )
    return Table("calibration-leds", ("layout", "leds", "led", "x_mm", "y_mm", "z_mm"), rows)


def _alone_table(setup: Setup, layouts: list[Layout]) -> Table:
    export = setup.export
    records: list[Record] = []
    for layout in layouts:
        information = shell_information(export, layout.leds)
        for name, sigma in (
            ("free", (FREE, FREE)),
            ("radius known", (FREE, 0.0)),
            ("prior 25 um", (PRIOR_MM, PRIOR_MM)),
        ):
            errors = ray_errors(information, [*range(len(layout.leds))], USUAL_PX, sigma)
            records.append(_case(layout, name) | _shares(*errors))
    design = layouts[0]
    records.append(_case(design, ONE_BALL) | _one_ball(setup, design))
    return Table.of_records("calibration-spheres", records)


def _case(layout: Layout, prior: str) -> Record:
    return {"layout": layout.name, "leds": len(layout.leds), "centre and radius": prior}


def _one_ball(setup: Setup, layout: Layout) -> Record:
    """Balls of the prototype, each by 50 stops of the base at known angles, nothing else free."""
    machine = replace(setup.designed, leds=layout.leds)
    series = np.zeros(len(machine.angle), dtype=np.int64)
    alone = prior_of(machine, series, {Block.CENTRES: LARGE_MM, Block.RADII: LARGE_MM})
    stops = np.linspace(0, len(setup.plan.angle) - 1, STOPS_OF_ONE).round().astype(np.int64)
    frame, sphere, led = _seen(setup, machine, stops)
    known = _bound(alone, USUAL_PX, (frame, sphere, led))
    rays = np.unique(np.stack([frame, sphere]), axis=1)
    errors = known_rays(alone, np.zeros(len(alone.free)), known, rays[0], rays[1])
    return _shares(errors.whole.place_mm, errors.whole.turn_mrad)


def _whole_table(setup: Setup, layouts: list[Layout], progress: Progress) -> Table:
    design = layouts[0]
    cases = [(design, USUAL_PROCESS, noise) for noise in NOISES_PX]
    cases += [(design, process, USUAL_PX) for process in PROCESSES if process != USUAL_PROCESS]
    cases += [(layout, USUAL_PROCESS, USUAL_PX) for layout in layouts[1:]]
    records: list[Record] = []
    for layout, process, noise in cases:
        progress(f"{len(layout.leds)} LEDs ({layout.name}), {process}, {noise:g} px")
        errors = whole_errors(setup, layout.leds, process, noise)
        records.append(
            {
                "layout": layout.name,
                "leds": len(layout.leds),
                "process": process,
                "noise_px": noise,
                **_shares(errors.relative.place_mm, errors.relative.turn_mrad),
                "in_run_mm": float(np.median(errors.in_run.place_mm)),
                "in_run_mrad": float(np.median(errors.in_run.turn_mrad)),
                "in_design_mm": float(np.median(errors.whole.place_mm)),
                "in_design_mrad": float(np.median(errors.whole.turn_mrad)),
            }
        )
    return Table.of_records("calibration-machine", records)


def whole_errors(setup: Setup, leds: Floats, process: str, noise_px: float) -> RayUncertainty:
    """How well the mirrors' rays are known after a whole run with LEDs (l, 3) at places in mm."""
    lit = replace(setup, designed=replace(setup.designed, leds=leds))
    prior = lit.prior(process_errors(load_process(process), caps=lit.export.spec.prototype.caps))
    seen = _seen(setup, prior.mean, np.arange(len(setup.frames)))
    _, _, frame, sphere = ray_places(setup)
    known = _bound(prior, noise_px, seen)
    return known_rays(prior, np.zeros(len(prior.free)), known, frame, sphere)


def _bound(prior: Prior, noise_px: float, seen: tuple[Ints, Ints, Ints]) -> Floats:
    """The covariance (q, q) that highlights of one noise allow, at the prior's mean."""
    _, slopes = highlights_with_slopes(prior, np.zeros(len(prior.free)), *seen)
    information = (slopes.T @ slopes).toarray() / noise_px**2
    return np.linalg.inv(information + np.eye(len(information)))


def _seen(setup: Setup, machine: Machine, frames: Ints) -> tuple[Ints, Ints, Ints]:
    """Frame, sphere and LED of highlights in the picture that the object's room does not hide."""
    grid = np.meshgrid(frames, np.arange(len(machine.radius)), np.arange(len(machine.leds)))
    frame, sphere, led = (one.ravel() for one in grid)
    pixel = machine.highlights(frame, sphere, led)
    size = np.array([machine.camera.width_px, machine.camera.height_px])
    inside = ((pixel >= 0) & (pixel <= size - 1)).all(axis=1)
    export = setup.export
    apex = machine.centres(frame, sphere)
    virtual = unit(apex + machine.radius[sphere, None] * unit(-apex)) * mirror_distance(export)
    hidden = hidden_by_object(
        export.spec.prototype.stage, machine.leds, virtual, export.capture_mm / 2
    )
    kept = inside & ~hidden[np.arange(len(led)), led]
    return frame[kept], sphere[kept], led[kept]


def designed_setup(export: ExportedDesign) -> Setup:
    """The prototype of a build with all frames of both runs, before it is photographed."""
    camera, frames = export.reflectors[0].camera, frames_of(read_plan(export).angle)
    return prepared_setup(export, frames, (camera.width_px, camera.height_px), None)


def _shares(mm: Floats, mrad: Floats) -> Record:
    """Median and 95 % of the mirrors."""
    figures: Record = {}
    for name, values in (("mrad", mrad), ("mm", mm)):
        for share in SHARES:
            figures[f"{name}_{share}"] = float(np.percentile(values, share))
    return figures


def panels(whole: Table, process: str) -> tuple[PlotPanel, ...]:
    """Errors at the object of whole machines, by noise and by number of LEDs."""
    records = whole.records()
    noise = [r for r in records if r["layout"] == "design" and r["process"] == process]
    leds = [r for r in records if r["layout"] == "best"]
    drawn = (
        ("Rays after a run, fdm, LEDs of the design", "noise of highlights, px", "noise_px", noise),
        ("Rays after a run, fdm, best LEDs", "number of LEDs", "leds", leds),
    )
    found = []
    for title, label, x, rows in drawn:
        curves = (
            Series(name, _values(rows, x), _values(rows, f"mm_{share}"), style)
            for name, share, style in (("median", 50, "C0o-"), ("95 %", 95, "C1o-"))
        )
        found.append(PlotPanel(title, label, "mm at the object's centre", tuple(curves)))
    return tuple(found)


def _values(records: list[Record], name: str) -> Floats:
    return np.array([r[name] for r in records], dtype=np.float64)

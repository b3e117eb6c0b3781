"""All that a maker reads of an assembly, once: the page and the PDF show the same words.

Times are sums of minutes for each thing that is done; none is measured, and the words say so.
"""

import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from tbcad.cad.formats.checked_files import Row
from tbcad.core.spec.design import PrinterSpec
from tbcad.prototype.assembly_steps.machine import OWN, AssembledMachine
from tbcad.prototype.assembly_steps.steps import SCREWED, Step, Use, assembly_steps
from tbcad.prototype.files.bom import totals
from tbcad.prototype.purchased.parts import without_example
from tbcad.prototype.slicing import print_settings

ROUND_MIN = 5.0  # that times are rounded to
MIN_PER_H, G_PER_KG = 60.0, 1000.0
RESIN = "resin"  # of caps that are polished by hand
SETTINGS = (
    *("layer_height", "extrusion_width", "perimeters", "top_solid_layers"),
    "support_material_threshold",
)


@dataclass(frozen=True)
class Instructions:
    """How a prototype is assembled."""

    about: tuple[str, ...]  # paragraphs at the beginning
    tools: tuple[str, ...]  # of the whole assembly
    printing: tuple[tuple[str, str], ...]  # settings of the slicer, and what they are for
    steps: tuple[Step, ...]  # each of a subassembly, in order
    designations: dict[int, str]  # of each part of the list, without a supplier's number
    minutes: dict[str, float]  # of work, by keys of steps
    times: tuple[str, ...]  # what the minutes are, and are not
    step_tools: dict[str, tuple[str, ...]]  # by keys of steps
    tested: tuple[tuple[str, str], ...]  # what it works with, and how far that was tried
    not_drawn: tuple[str, ...]  # parts without a body, and why

    def uses(self, step: Step) -> list[tuple[str, ...]]:
        """Number, quantity, name and designation of each part that a step takes."""
        return [
            (str(use.item), str(use.quantity), use.part, self.designations[use.item])
            for use in step.parts
        ]


def instructions(machine: AssembledMachine, printer: PrinterSpec) -> Instructions:
    """The instructions for a prototype. InputError: as `assembly_steps`."""
    words, steps = _words(), assembly_steps(machine)
    kinds = {machine.kind(part) for part in machine.bill.items}
    done = {what for step in steps for what in _done(machine, step)}
    each = ", ".join(f"{what} {one:g}" for what, one in words["minutes"].items() if what in done)
    sums = totals(machine.bill.rows)
    return Instructions(
        about=tuple(words["about"]),
        tools=(
            *words["tools"],
            *(tool for kind, tool in words["tools_of_kinds"].items() if kind in kinds),
        ),
        printing=tuple(_printing(printer, sums)),
        steps=steps,
        designations={int(row["item"] or 0): designation(row) for row in machine.bill.rows},
        minutes={step.key: work_minutes(machine, step) for step in steps},
        times=tuple(text.format(**sums, minutes=each) for text in words["times"]),
        step_tools={step.key: tuple(dict.fromkeys(_tools(machine, step))) for step in steps},
        tested=tuple((what, result) for what, result in words["tested"]),
        not_drawn=tuple(_not_drawn(machine, steps)),
    )


def _printing(printer: PrinterSpec, sums: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """What a slicer is to be told, by the settings that filament and hours are estimated for."""
    use = print_settings(printer.nozzle_mm)
    told = {key: use[key] for key in SETTINGS} | dict(printer) | sums
    bed = " x ".join(f"{side:g}" for side in printer.bed_mm)
    for what, text in _words()["printing"]:
        yield what, text.format(**told, bed=bed, kg=sums["filament_g"] / G_PER_KG)


def designation(row: Row) -> str:
    """A part of the list by standards and sizes: without the number of a supplier."""
    return without_example(str(row["what"]))


def work_minutes(machine: AssembledMachine, step: Step) -> float:
    """Minutes of one person for a step: each instruction, check, part and hole."""
    each = _words()["minutes"]
    return float(sum(each[what] * count for what, count in _done(machine, step).items()))


def _done(machine: AssembledMachine, step: Step) -> Counter[str]:
    """How often each kind of work is done in a step."""
    counts = Counter({"instructions": len(step.does), "checks": len(step.checks)})
    for use in step.parts:
        counts[_work(machine, use)] += use.quantity
        if machine.kind(use.part) == "plates":
            counts["holes"] += sum(
                "plate" in one.through and machine.kind(one.part) in SCREWED
                for one in machine.fasteners
            )
    if step.key == "wiring":
        counts["lines of wiring"] += len(machine.wiring)
    return counts


def hours_text(minutes: float) -> str:
    """A time, rounded: such as 25 min or 2 h 10 min."""
    whole = round(max(minutes, ROUND_MIN) / ROUND_MIN) * int(ROUND_MIN)
    hours, rest = divmod(whole, int(MIN_PER_H))
    return " ".join([f"{hours} h"] * (hours > 0) + [f"{rest} min"] * (rest > 0))


def _work(machine: AssembledMachine, use: Use) -> str:
    """Work on a part: by its kind, or by its body where it is in no list."""
    if (kind := machine.kind(use.part)) != OWN:
        return kind
    if not use.bodies or not machine.is_printed(use.bodies[0]):
        return "balls"
    caps = {f"cap_{one.ball}": one.material == RESIN for one in machine.record.caps}
    by_hand = caps.get(use.bodies[0])
    return "printed parts" if by_hand is None else "caps" if by_hand else "turned caps"


def _tools(machine: AssembledMachine, step: Step) -> Iterator[str]:
    """Keys by thread, then what parts of a kind need."""
    words = _words()
    for use in step.parts:
        part, kind = machine.listed(use.part), machine.kind(use.part)
        if part and kind in SCREWED:
            size = words["keys"][kind].get(f"{part['thread_mm']:g}")
            yield f"hexagon key {size}" if size else "screwdriver"
    for use in step.parts:
        part, kind = machine.listed(use.part), machine.kind(use.part)
        tool = words["step_tools"].get(kind)
        if tool := tool.get(step.key) if isinstance(tool, dict) else tool:
            width = f"{part['width_mm']:g}" if part and kind == "nuts" else ""
            yield from tool.format(nut=width).split(", ")


def _not_drawn(machine: AssembledMachine, steps: tuple[Step, ...]) -> Iterator[str]:
    """Parts without a body, by the reason, which there is for each kind."""
    reasons, kinds = _words()["without_body"], dict[str, list[str]]()
    for use in (use for step in steps for use in step.parts if not use.bodies):
        kinds.setdefault(reasons[machine.kind(use.part)], []).append(machine.ref(use.part))
    yield from (f"{', '.join(dict.fromkeys(parts))}: {why}" for why, parts in kinds.items())


@cache
def _words() -> dict[str, Any]:
    place = files("tbcad.prototype.assembly_steps") / "instructions.toml"
    return tomllib.loads(place.read_text(encoding="utf-8"))

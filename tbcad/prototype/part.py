"""A part of the prototype: its layout on the frame, its steps of assembly, sheets and remedies.

`registry` lists all parts; bodies, list of purchases, drawings, steps and errors walk it.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from tbcad.cad.drafting.sheet import Sheet
from tbcad.core.geometry.primitives import Component
from tbcad.core.spec.design import Spec
from tbcad.prototype.assembly_steps.machine import StepPlan
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.files.bom import PartsList
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.purchased.parts import Parts
from tbcad.prototype.stage.layout import StageLayout
from tbcad.types import Floats


@dataclass(frozen=True, kw_only=True)
class Site:
    """The surroundings that parts of the frame are laid out for."""

    spec: Spec  # of the design
    layout: PrototypeLayout  # balls, their places, the plan of the stops
    base: BaseLayout  # layout of the carrier
    drive: Drive  # that turns it
    keep_out: KeepOut  # what static parts must keep out of
    stage: StageLayout  # layout of the object stage
    parts: Parts  # lists of purchased parts

    @property
    def axes(self) -> Floats:
        """Axes of the frame, as of `frame_axes`."""
        return frame_axes(self.base.frame[0])


def frame_axes(axis: Floats) -> Floats:
    """Axes of the frame, as rows: level under the axis w (3,), across it, up, (3, 3)."""
    level = np.array([axis[0], axis[1], 0.0]) / np.hypot(*axis[:2])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([level, np.cross(up, level), up])


@dataclass(frozen=True)
class Bracket:
    """A part that is screwed on the base plate, printed, or bought where its component says so."""

    component: Component  # the part itself
    # tapped holes that it needs in the base plate, (x, y) along the frame's axes, (h, 2)
    holes: Floats
    foot: Floats  # corners of its foot on the plate, the same, (f, 2)
    fasteners: tuple[Fastener, ...] = ()  # of it, but for those in the base plate
    thickness: float | None = None  # of it at its holes, mm; None: prototype.frame.flange_mm


@dataclass(frozen=True, kw_only=True)
class Mounted:
    """Additions of a part to the frame, in the frame of the shell."""

    brackets: tuple[Bracket, ...] = ()  # on the base plate
    printed: tuple[Component, ...] = ()  # other bodies to print
    tools: tuple[Component, ...] = ()  # to print, and not in the assembly
    purchased: tuple[Component, ...] = ()  # simple bodies of what is bought, for the assembly
    fasteners: tuple[Fastener, ...] = ()  # in their places, but those of brackets
    listed: Mapping[str, int] = field(default_factory=dict)  # what else is bought: pieces by name


M = TypeVar("M", bound=Mounted)


@dataclass(frozen=True)
class FrameLayout:
    """The parts of the frame in the order of their layout: the head first, the stock last.

    Their order decides the numbers of items and fasteners.
    """

    mounted: tuple[Mounted, ...]
    light: dict[str, float] = field(default_factory=dict)  # smallest distance of each to it, mm
    swept: dict[str, float] = field(default_factory=dict)  # to what the base sweeps, mm

    def find(self, kind: type[M]) -> M | None:
        """The layout of a kind; None without."""
        return next((one for one in self.mounted if isinstance(one, kind)), None)

    def of(self, kind: type[M]) -> M:
        """The layout of a kind that every frame has."""
        return next(one for one in self.mounted if isinstance(one, kind))

    @property
    def brackets(self) -> tuple[Bracket, ...]:
        """All that stand on the base plate."""
        return tuple(bracket for one in self.mounted for bracket in one.brackets)

    @property
    def printed(self) -> tuple[Component, ...]:
        """Bodies to print: brackets after what is not on the plate, before what they carry."""
        carried, others = (
            [body for one in self.mounted if bool(one.brackets) is flag for body in one.printed]
            for flag in (True, False)
        )
        return (*others, *self._standing(bought=False), *carried)

    def _standing(self, *, bought: bool) -> tuple[Component, ...]:
        """Brackets that are bought, or printed."""
        some = (bracket.component for bracket in self.brackets)
        return tuple(body for body in some if bool(body.part) is bought)

    @property
    def tools(self) -> tuple[Component, ...]:
        """Tools that are printed to assemble the other parts."""
        return tuple(body for one in self.mounted for body in one.tools)

    @property
    def purchased(self) -> tuple[Component, ...]:
        """Simple bodies of purchased parts."""
        stock_first = (*self.mounted[-1:], *self.mounted[:-1])
        bodies = tuple(body for one in stock_first for body in one.purchased)
        return (*bodies, *self._standing(bought=True))

    @property
    def fasteners(self) -> tuple[Fastener, ...]:
        """Those of the head, of what stands on the plate, of the plate, of all others."""
        head, *others, stock = self.mounted
        in_order: tuple[Mounted | Bracket, ...] = (head, *self.brackets, stock, *others)
        return tuple(fastener for one in in_order for fastener in one.fasteners)


@dataclass(frozen=True)
class Part:
    """A part, or several that are laid out and mounted together."""

    steps: tuple[StepPlan, ...] = ()  # of its assembly, in order
    # on the frame, beside the parts before it; None where a design has none
    layout: Callable[[Site, FrameLayout], Mounted | None] = lambda site, before: None
    # of what is cut or drilled by hand, with the list of parts
    sheets: Callable[[Site, FrameLayout, PartsList], Iterable[Sheet]] = lambda *_: ()
    # what to change where bodies meet light or base, by patterns of their names
    remedies: Mapping[str, str] = field(default_factory=dict)

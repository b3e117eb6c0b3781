"""Prototypes that several test files look at, and a small one's surroundings."""

import pytest

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.load import load_spec
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.arrangement import frame_layout
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.keepout import KeepOut, keep_out_volume
from tbcad.prototype.part import FrameLayout, Site
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout, stage_layout

# Balls are heavier than by default, so that some need stronger magnets.
HEAVY = "prototype.largest_ball_mm=60", "prototype.grade=G40"
# One of its balls is so near to the hub that a motor's pinion clears it by 2 mm only.
SMALL = load_spec(
    None,
    [
        *("n=6", "prototype.k=4", "prototype.ball_margin_mm=0", "prototype.base.hub_boss_mm=35"),
        *("prototype.frame.clearance_mm=1.5", *HEAVY),
    ],
)
PAPER = load_spec(None, ["prototype.ball_margin_mm=0", *HEAVY])
CAPTURE_RADIUS = 30.0


@pytest.fixture(scope="session")
def spec() -> PrototypeSpec:
    return SMALL.prototype


@pytest.fixture(scope="session")
def paper_prototype(paper_design: MirrorDesign) -> PrototypeLayout:
    """The prototype of the paper's design with heavy balls: 16, some of them caps."""
    return prototype_layout(PAPER, paper_design)


@pytest.fixture(scope="session")
def small_prototype(small_design: MirrorDesign) -> PrototypeLayout:
    """A quick one: four balls for the mirrors of n = 6."""
    return prototype_layout(SMALL, small_design)


@pytest.fixture(scope="session")
def layout(small_design: MirrorDesign) -> PrototypeLayout:
    """Six balls and caps, both, of the nearest sizes."""
    options = ["n=6", "prototype.k=6", "prototype.snap=nearest", *HEAVY]
    return prototype_layout(load_spec(None, options), small_design)


@pytest.fixture(scope="session")
def carrier(spec: PrototypeSpec, small_prototype: PrototypeLayout) -> BaseLayout:
    return base_layout(spec.base, small_prototype)


@pytest.fixture(scope="session")
def keep_out(small_prototype: PrototypeLayout, carrier: BaseLayout) -> KeepOut:
    return keep_out_volume(small_prototype, carrier, CAPTURE_RADIUS, 0.0)


@pytest.fixture(scope="session")
def stage(spec: PrototypeSpec, small_prototype: PrototypeLayout, keep_out: KeepOut) -> StageLayout:
    return stage_layout(spec, small_prototype, keep_out, load_parts())


@pytest.fixture(scope="session")
def site(
    small_prototype: PrototypeLayout, carrier: BaseLayout, stage: StageLayout, keep_out: KeepOut
) -> Site:
    parts = load_parts()
    return Site(
        spec=SMALL,
        layout=small_prototype,
        base=carrier,
        drive=load_drives(parts)[0],
        keep_out=keep_out,
        stage=stage,
        parts=parts,
    )


@pytest.fixture(scope="session")
def frame(site: Site) -> FrameLayout:
    return frame_layout(site)

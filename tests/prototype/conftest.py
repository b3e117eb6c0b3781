"""Prototypes that several test files look at."""

import pytest

from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.spec.load import load_spec


@pytest.fixture(scope="session")
def paper_prototype(paper_design: MirrorDesign) -> PrototypeLayout:
    """The default prototype of the paper's design: 16 balls, some of them caps."""
    return prototype_layout(load_spec(None), paper_design)


@pytest.fixture(scope="session")
def prototype(small_design: MirrorDesign) -> PrototypeLayout:
    """A quick one: four balls for the mirrors of n = 6."""
    return prototype_layout(load_spec(None, ["n=6", "prototype.k=4"]), small_design)

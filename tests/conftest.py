"""What several test files build once."""

import pytest

from tbcad.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.shell.envelope import Envelope
from tbcad.shell.files import shell_envelope
from tbcad.spec.load import load_spec


@pytest.fixture(scope="session")
def paper_design() -> MirrorDesign:
    """The paper's design with exact radii: n = 18, target 60 mm plus the default margin."""
    return design(load_spec(None))


@pytest.fixture(scope="session")
def paper_half(paper_design: MirrorDesign) -> MirrorArray:
    return paper_design.halves[0]


@pytest.fixture(scope="session")
def small_design() -> MirrorDesign:
    """A quick one with everything in it: few mirrors, both flanges, halved mirrors."""
    return design(load_spec(None, ["n=6"]))


@pytest.fixture(scope="session")
def small_half(small_design: MirrorDesign) -> MirrorArray:
    return small_design.halves[0]


@pytest.fixture(scope="session")
def small_envelope(small_design: MirrorDesign) -> Envelope:
    return shell_envelope(small_design)

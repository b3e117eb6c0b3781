"""A small machine as the fast model sees it."""

import pytest

from tbcad.mirrors.array import MirrorDesign
from tbcad.simulate.scene.reflector import reflectors
from tbcad.tolerance.montecarlo.edge_model import EdgeModel, nominal


@pytest.fixture(scope="session")
def halves(small_design: MirrorDesign) -> tuple[EdgeModel, EdgeModel]:
    a, b = (nominal(at) for at in reflectors(small_design))
    return a, b

"""A small build as the fast model sees it."""

import pytest

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models


@pytest.fixture(scope="session")
def halves(small_design: MirrorDesign) -> EdgeModels:
    return edge_models(reflectors(small_design))

"""Mirrors of designs that tests ask for."""

from functools import lru_cache

from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import load_spec


@lru_cache(maxsize=16)
def designed(spec: Spec) -> MirrorDesign:
    """The mirrors of a spec, made once for all who ask for them."""
    return design(spec)


def mirror_design(*settings: str) -> MirrorDesign:
    """The paper's design with other settings ("key=value")."""
    return designed(load_spec(None, settings))


def mirror_array(*settings: str) -> MirrorArray:
    """Camera a's mirrors of such a design."""
    return mirror_design(*settings).arrays[0]

"""Mirrors of designs that tests ask for."""

from tbcad.mirrors.array import MirrorArray, design
from tbcad.spec.load import load_spec


def mirror_array(*settings: str) -> MirrorArray:
    """Camera a's mirrors of the paper's design with other settings ("key=value")."""
    return design(load_spec(None, settings)).arrays[0]

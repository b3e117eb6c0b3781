"""One small real export."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tbcad_verify.run.verify import VerifyOptions

from tbcad.cli import run
from tests.verify.corpus.copies import digests

HERE = VerifyOptions(write=False, apart=False)
SETTINGS = (
    "optics.n=4",
    "camera.hfov_deg=110",
    "camera.width_px=416",
    "camera.height_px=310",
    "mirrors.margin_mm=2",
    "mesh.ray_error_mm=0.3",
    "mesh.structure_error_mm=0.2",
)


@contextmanager
def export(room: Path) -> Iterator[Path]:
    """A small export as `tbcad build` writes and proves it; whoever breaks copies leaves it so."""
    folder = room / "good"
    options = [word for setting in SETTINGS for word in ("--set", setting)]
    assert run(["build", "--parts", "shell", *options, "--out", str(folder)]) == 0
    before = digests(folder)
    yield folder
    assert digests(folder) == before, "a mutation wrote through a link"

"""What hides the LEDs from the balls: the object and the stage that it stands on."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.geometry.vectors import norm
from tbcad.records.prototype import NAME, PrintedPartRecord, Prototype
from tbcad.simulate.prototype.plan import HALF_TURN
from tbcad.simulate.scene.ray_casting import embree_scene
from tbcad.types import Bools, Floats

NEAR_MM = 0.05  # of the LED: its dome stands in its pocket


@dataclass(frozen=True)
class Occluders:
    """Meshes before LEDs.

    Attributes:
        subject: scene of the object, as it stands in the first run; None without an object.
        stage: scene of the stage, which does not turn; None where its meshes are not there.
    """

    subject: Any | None
    stage: Any | None

    def hide(self, point: Floats, led: Floats, turned: bool) -> Bools:
        """Which of n points (n, 3) have something between them and places on LEDs (n, 3)."""
        way = led - point
        length = norm(way)
        direction = way / length[:, None]
        flip = HALF_TURN if turned else np.ones(3)
        hidden = _nearer(self.subject, point * flip, direction * flip, length)
        return hidden | _nearer(self.stage, point, direction, length)


def _nearer(scene: Any | None, origin: Floats, direction: Floats, length: Floats) -> Bools:
    if scene is None or len(origin) == 0:
        return np.zeros(len(origin), dtype=bool)
    hits = scene.run(origin.astype(np.float32), direction.astype(np.float32), output=1)
    return np.asarray((hits["primID"] >= 0) & (hits["tfar"] < length - NEAR_MM))


def stage_scene(folder: Path) -> Any | None:
    """The stage's printed parts of an export in their places; None where it has none.

    Raises:
        InputError: the record or a mesh cannot be read.
    """
    parts = Prototype.read(folder / NAME).with_role("stage")
    facets = [_placed(folder, part) for part in parts]
    return embree_scene(np.concatenate(facets)) if facets else None


def _placed(folder: Path, part: PrintedPartRecord) -> Floats:
    """Facets of a part by their corners, mm, (f, 3, 3), back from the printer's bed."""
    import trimesh

    path = folder / Path(part.stl).name
    try:
        mesh: Any = trimesh.load(path, file_type="stl", force="mesh", process=False)
        corners = np.asarray(mesh.triangles, dtype=np.float64)
    except Exception as error:  # trimesh's readers raise whatever their libraries do
        raise InputError(f"{path} cannot be read: {error}: build it again") from None
    return np.asarray((corners - part.origin_mm) @ np.array(part.axes).T)

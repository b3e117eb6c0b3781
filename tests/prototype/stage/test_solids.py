"""The stage as solids: ways of the wires in the mesh, volumes by closed forms."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import trimesh

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.prototype.printed import PlacedSolid, placed_component
from tbcad.prototype.stage.crown import DISC_MM, STUD_MM, STUD_PLAY_MM
from tbcad.prototype.stage.layout import StageLayout
from tests.helpers import as_trimesh

PRINTER = PrinterSpec()
SIZED = load_spec(None).prototype.stage


@pytest.fixture(scope="module")
def solids(stage: StageLayout) -> dict[str, PlacedSolid]:
    parts = (*stage.components, replace(stage.post, downs=(np.array([1.0, 0.0, 0.0]),)))
    return {part.name: placed_component(part, PRINTER, 0.1) for part in parts}


@pytest.fixture(scope="module")
def crown(solids: dict[str, PlacedSolid]) -> trimesh.Trimesh:
    return as_trimesh(solids["stage_crown"].shape, 0.01)


class TestSolids:
    def test_each_is_watertight_and_has_its_volume(
        self, solids: dict[str, PlacedSolid], stage: StageLayout
    ) -> None:
        assert list(solids) == ["stage_disc", "stage_crown", "stage_post"]
        for part in solids.values():
            mesh = as_trimesh(part.shape, 0.01)
            assert mesh.is_watertight
            assert mesh.is_winding_consistent
            assert mesh.body_count == 1
            assert mesh.volume == pytest.approx(part.volume, rel=2e-3)
        disc, wall = SIZED.disc_mm / 2, 2.0
        stud = min(STUD_MM, disc / 5) + STUD_PLAY_MM
        area = np.pi * (disc**2 - 2 * stud**2)
        assert solids["stage_disc"].volume == pytest.approx(area * DISC_MM, rel=1e-9)
        tube = np.pi * (10.0**2 - (10.0 - wall) ** 2) * (stage.sizes.joint - stage.foot)
        # Holes of set screw and wires are nearly as long as the wall is thick.
        hole = np.pi * (1.25**2 + 3.0**2) * wall
        assert solids["stage_post"].volume == pytest.approx(tube - hole, abs=0.1 * hole)

    def test_wires_come_from_every_pocket_to_the_bores_end(
        self, stage: StageLayout, crown: trimesh.Trimesh
    ) -> None:
        """A way of points in the open: inward from the pocket, down and along the arm's inner

        faces, then along the groove and down the bore.
        """
        groove, face = stage.sizes.plate - 0.8, stage.sizes.plate + DISC_MM
        end = crown.bounds[0, 2] - 1
        steps = np.linspace(0, 1, 40)[:, None]
        for place in stage.leds:
            floor = place[2] - (stage.led["height_mm"] - stage.led["diameter_mm"] / 2)
            out = np.array([*unit(place[:2]), 0.0])
            inner = float(norm(place[:2])) - (stage.led["flange_mm"] / 2 + 0.1 + SIZED.led_wall_mm)
            root = stage.sizes.rim - 0.4 * (stage.sizes.rim - stage.sizes.wire)
            corners = np.array(
                [
                    [*place[:2], floor - 0.4],
                    (inner + 0.4) * out + [0, 0, floor - 0.4],
                    (inner + 0.4) * out + [0, 0, face - 0.3],
                    (root - 0.3) * out + [0, 0, groove + 0.5],
                    [0, 0, groove],
                    [0, 0, end],
                ]
            )
            way = np.vstack([a + steps * (b - a) for a, b in pairwise(corners)])
            assert not crown.contains(way).any()
            # Material behind the groove, all the way up the arm.
            assert crown.contains(way[46:80] + 1.0 * out).all()

    def test_a_bed_too_small_is_refused(self, stage: StageLayout) -> None:
        with pytest.raises(SpecError, match="stage_crown does not fit"):
            placed_component(stage.components[1], PrinterSpec(bed_mm=(40.0,) * 3), 0.1)

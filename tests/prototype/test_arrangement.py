"""The arrangement of a prototype: every layout has room, and the spec's own values are kept."""

from collections.abc import Iterator

import pytest

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec, spec_dict
from tbcad.core.spec.prototype import PAD_ANGLES_DEG, Hold
from tbcad.prototype import arrangement
from tbcad.prototype.arrangement import PrototypeModel, arrange, arrangements
from tbcad.prototype.base.layout import base_layout
from tbcad.prototype.base.solid import carrier_parts
from tbcad.prototype.base.split import BedError
from tbcad.prototype.drive.balance import ball_masses
from tests.prototype.conftest import HEAVY


@pytest.fixture(scope="module")
def small(small_design: MirrorDesign) -> PrototypeModel:
    return arrange(small_design)


def magnets_hold(arrangement: PrototypeModel, pad_angle_deg: float) -> bool:
    """Whether magnets hold the balls of an arrangement on pads at an angle."""
    changed = {"hold": "magnet", "pad_angle_deg": pad_angle_deg}
    section = arrangement.spec.prototype.base.model_copy(update=changed)
    try:
        base_layout(section, arrangement.layout)
    except SpecError:
        return False
    return True


class TestChoice:
    def test_leaves_no_key_open(self, small: PrototypeModel) -> None:
        prototype = spec_dict(small.spec)["prototype"]
        assert "auto" not in [*prototype.values(), *prototype["base"].values()]
        assert prototype["base"]["hold"] == "magnet"
        clearance = small.spec.prototype.frame.clearance_mm
        assert min(*small.frame.light.values(), *small.frame.swept.values()) >= clearance
        assert small.stage.swept >= clearance
        assert small.layout.fit.coverage.min() >= 60 - 1e-6

    def test_keeps_what_the_spec_sets(self) -> None:
        options = ["n=6", "prototype.k=3", "base.hold=glue", "pad_angle_deg=35", "hub_boss_mm=30"]
        chosen = arrange(design(load_spec(None, options))).spec.prototype
        base = chosen.base
        assert (chosen.k, base.hold, base.pad_angle_deg, base.hub_boss_mm) == (3, "glue", 35, 30)

    @pytest.mark.parametrize(("k", "hold"), [(1, "glue"), (3, "magnet")])
    def test_glue_only_where_no_magnet_holds(
        self, k: int, hold: Hold, small_design: MirrorDesign
    ) -> None:
        """The ball of one for all mirrors is too heavy for magnets at any angle of its pads."""
        fixed = MirrorDesign(
            load_spec(None, ["n=6", f"prototype.k={k}", *HEAVY]), small_design.arrays
        )
        every = list(arrangements(fixed))
        assert {one.spec.prototype.base.hold for one in every} == {hold}
        held = [angle for angle in PAD_ANGLES_DEG if magnets_hold(every[0], angle)]
        assert bool(held) == (hold == "magnet")

    @pytest.mark.parametrize(
        "n", [2, *(pytest.param(n, marks=pytest.mark.designs) for n in (4, 8, 11, 16, 30))]
    )
    def test_many_subdivisions(self, n: int) -> None:
        """Above 30 an arrangement takes up to two minutes to find; builds have other numbers."""
        chosen = arrange(design(load_spec(None, [f"n={n}"])))
        assert chosen.layout.fit.coverage.min() >= 60 - 1e-6


class TestMass:
    @pytest.mark.slow
    def test_estimate_agrees_with_the_solid(self, small: PrototypeModel) -> None:
        """Flanges, numbers and overlaps of ribs are left out: some per cent."""
        printer = small.spec.printer
        solids = carrier_parts(small.base, small.split, printer, 0.1)
        exact = sum(part.mass_g(printer.density_g_cm3) for part in solids)
        carried = ball_masses(small.layout).mass_g.sum()
        assert small.balance.mass_g - carried == pytest.approx(exact, rel=0.15)


class TestRefused:
    def test_the_cause_and_what_was_tried(self) -> None:
        spec = load_spec(None, ["n=3", "camera_diameter_mm=500", "camera_length_mm=1000"])
        with pytest.raises(SpecError, match=r"camera_diameter_mm smaller \(tried: \d+, .* balls\)"):
            arrange(design(spec))

    def test_a_remedy_that_was_tried(self, small_design: MirrorDesign) -> None:
        """A ball for every mirror is too many; the message names a number that has room."""
        spec = load_spec(None, ["n=6", "prototype.k=103"])
        fixed = MirrorDesign(spec, small_design.arrays)
        with pytest.raises(SpecError, match=r"tried: there is room with prototype\.k auto \(which"):
            arrange(fixed)


def test_a_bed_that_is_too_small_for_several_ends_the_search(
    small_design: MirrorDesign, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each attempt takes seconds, and there are dozens."""
    tried = []

    def attempts(design: MirrorDesign) -> Iterator[tuple[Spec, SpecError]]:
        for error in [SpecError("light"), *map(BedError, "abcdefg")]:
            tried.append(str(error))
            yield load_spec(None, ["prototype.k=3"]), error

    monkeypatch.setattr(arrangement, "_attempts", attempts)
    with pytest.raises(BedError, match=r"^a \(tried: 3 balls\)$"):
        arrange(small_design)
    assert tried == ["light", "a", "b", "c"]

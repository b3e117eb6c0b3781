"""Designs that a prototype can be made of."""

from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError


def check_suitable(spec: Spec) -> None:
    """Refuse designs that balls or a single camera cannot stand in for.

    One camera photographs both halves only if a half turn of the object swaps the cameras.

    SpecError as said.
    """
    if spec.mirrors.radius_rule == "flat":
        raise SpecError(
            "a prototype of balls needs curved mirrors, but mirrors.radius_rule is flat: set it "
            "to traced or paper"
        )
    if spec.optics.camera_mm[1] != 0:
        raise SpecError(
            f"a prototype needs cameras that a half turn about z swaps, but optics.camera_mm has "
            f"y = {spec.optics.camera_mm[1]:g}: set it to 0, or build --parts shell"
        )

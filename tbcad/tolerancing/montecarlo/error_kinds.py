"""The kinds of error of a process, with their spread and mean: read before numpy is loaded."""

from dataclasses import dataclass, replace
from math import hypot, sqrt
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import numpy as np

    from tbcad.types import Floats

Distribution = Literal["normal", "uniform"]


@dataclass(frozen=True)
class Error:
    """One kind of error."""

    spread: float = 0.0  # sigma if normal, half width if uniform; mm, radians or a share
    mean: float = 0.0  # error common to all builds, in the same unit
    distribution: Distribution = "normal"  # of the error about its mean
    length: float = 0.0  # over which places of one part share the error, mm; 0: each has its own

    @property
    def sigma(self) -> float:
        """Standard deviation."""
        return self.spread if self.distribution == "normal" else self.spread / sqrt(3)

    def sample(self, generator: "np.random.Generator", *shape: int) -> "Floats":
        """Random errors of a shape."""
        normal = self.distribution == "normal"
        deviation = generator.standard_normal(shape) if normal else generator.uniform(-1, 1, shape)
        errors: Floats = self.mean + self.spread * deviation
        return errors


NO_ERROR = Error()
BEARINGS_MM = 50.0  # between the bearings of a prototype's shaft, as its head has them, about


@dataclass(frozen=True)
class Errors:
    """Errors of a manufacturing process, one kind a field, in mm, radians and shares (1 = 100 %).

    They are what the keys of tolerancing.process.process.Process say, with these of their own:
    """

    sphere_centre: Error = NO_ERROR
    sphere_radius: Error = NO_ERROR
    scale_isotropic: Error = NO_ERROR
    scale_axis: Error = NO_ERROR
    shell_shift: Error = NO_ERROR
    shell_tilt: Error = NO_ERROR
    camera_shift: Error = NO_ERROR
    camera_tilt: Error = NO_ERROR
    camera_focal: Error = NO_ERROR
    coating: Error = NO_ERROR  # by which a shell's coating is thicker than the design allows for
    facets: Error = NO_ERROR
    rotation_angle: Error = NO_ERROR
    axis_runout: Error = NO_ERROR
    axis_tilt: Error = NO_ERROR
    ball_radius: Error = NO_ERROR  # of each ball's radius, by its grade
    seat: Error = NO_ERROR
    cap_tilt: Error = NO_ERROR
    cap_sagitta: Error = NO_ERROR
    cap_astigmatism: Error = NO_ERROR
    cap_coma: Error = NO_ERROR
    cap_trefoil: Error = NO_ERROR
    cap_spherical: Error = NO_ERROR
    wind_up: Error = NO_ERROR
    sag: Error = NO_ERROR
    warp: Error = NO_ERROR  # of length 0 an error of each mirror's centre
    waviness: Error = NO_ERROR
    groove_wall: Error = NO_ERROR
    cutter_radius: Error = NO_ERROR  # of fillets that it leaves in the valleys
    ridge_rounding: Error = NO_ERROR  # of the fillets there that a mandrel's ridges leave

    @property
    def weight(self) -> float:
        """Share of the mean sag that acts, and that seats are placed against: 1 with gravity."""
        return min(self.sag.mean, 1.0)

    @property
    def axis_wobble(self) -> Error:
        """Direction of the base at a stop, by run-outs of both bearings, one against the other."""
        return replace(self.axis_runout, spread=self.axis_runout.spread * sqrt(2) / BEARINGS_MM)

    @property
    def whole_radius(self) -> Error:
        """Error of the radius of a mirror that is a part of its own, such as a cap.

        Where a part's limit gives its points a warp, half of it along the normal is its size
        (docs/decisions/0007); the other half is its place.
        """
        if self.warp.spread == 0:
            return self.sphere_radius
        spread = hypot(self.sphere_radius.sigma, self.warp.spread / sqrt(2))
        return Error(spread, self.sphere_radius.mean)

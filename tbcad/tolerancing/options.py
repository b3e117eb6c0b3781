"""What an analysis is asked for; read before anything heavy is loaded."""

from dataclasses import dataclass

from tbcad.errors import InputError


def check_yield(wanted_yield: float) -> None:
    """Refuse a share of good builds that is not between 0 and 1."""
    if not 0 < wanted_yield < 1:
        raise InputError(f"--yield {wanted_yield:g}: allowed is above 0, below 1, like 0.99")


@dataclass(frozen=True)
class ToleranceOptions:
    """Options of an analysis.

    Attributes:
        builds: number of simulated builds, 10 to 1000000.
        seed: of all random errors, 0 or more.
        wanted_yield: share of the builds that must be good, above 0, below 1.
        calibration_residual: error of a mirror's direction after calibration, radians, below 0.1.
        scheduler: address of a Dask scheduler; None for this machine's cores.
        every_process: whether the yields of all built-in processes are compared.
        margins: whether the margins are searched for that the processes need.

    Raises:
        InputError: a value is not allowed.
    """

    builds: int = 1000
    seed: int = 1
    wanted_yield: float = 0.99
    calibration_residual: float = 0.5e-3
    scheduler: str | None = None
    every_process: bool = False
    margins: bool = False

    def __post_init__(self) -> None:
        """Check all values."""
        if not 10 <= self.builds <= 1_000_000:
            raise InputError(f"--builds {self.builds}: allowed is 10 to 1000000")
        check_yield(self.wanted_yield)
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: allowed is 0 or more")
        if not 0 <= self.calibration_residual < 0.1:
            raise InputError(
                f"--calibrated-mrad {1000 * self.calibration_residual:g}: allowed is 0 to 100"
            )

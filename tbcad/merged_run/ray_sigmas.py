"""How well a calibration knows the rays of each mirror, for what is fitted to them."""

from collections.abc import Iterable, Mapping
from math import hypot
from pathlib import Path

from pydantic import Field

from tbcad.formats.checked_files import Finite, Record, read_csv

RAYS = "rays.csv"
CALIBRATE = "calibrate again with tbcad calibrate"


class _Ray(Record):
    mirror: str = Field(pattern=r"^[ab]\d{4,8}$")
    sigma_mm: Finite = Field(ge=0)
    sigma_mrad: Finite = Field(ge=0)


def ray_sigmas(
    folders: Iterable[Path], mirrors: Mapping[str, int], capture_mm: float
) -> dict[str, list[float | None]]:
    """Root mean square error of the rays of each mirror where the object is, mm, by camera.

    At the centre it is `sigma_mm`; elsewhere their angle counts too, here at half the radius of
    the capture sphere. None: the calibration does not say.

    Args:
        folders: of the calibration, each with a table; older ones have none.
        mirrors: of each camera, their number.
        capture_mm: diameter of the capture sphere.

    Raises:
        InputError: a table is damaged.
    """
    files = [folder / RAYS for folder in folders]
    known = {
        ray.mirror: round(hypot(ray.sigma_mm, ray.sigma_mrad / 1000 * capture_mm / 4), 5)
        for file in files
        if file.is_file()
        for ray in read_csv(file, _Ray, CALIBRATE)
    }
    return {
        camera: [known.get(f"{camera}{number + 1:04d}") for number in range(count)]
        for camera, count in mirrors.items()
    }

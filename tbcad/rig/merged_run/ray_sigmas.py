"""How well a calibration knows the rays of each mirror, for what is fitted to them."""

from collections.abc import Iterable, Mapping
from math import hypot
from pathlib import Path

from tbcad.records.tables import RayRow


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
    known = {
        ray.mirror: round(hypot(ray.sigma_mm, ray.sigma_mrad / 1000 * capture_mm / 4), 5)
        for folder in folders
        if (folder / RayRow.FILE).is_file()
        for ray in RayRow.read(folder)
    }
    return {
        camera: [known.get(f"{camera}{number + 1:04d}") for number in range(count)]
        for camera, count in mirrors.items()
    }

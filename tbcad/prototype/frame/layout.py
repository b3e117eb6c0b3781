"""The frame: all parts round base and stage, clear of light and of what the base sweeps."""

from dataclasses import replace
from fnmatch import fnmatchcase

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.keepout import min_distance
from tbcad.prototype.part import FrameLayout, Site
from tbcad.prototype.registry import FRAME, PARTS

MAY_BE_LIT = ("camera", "camera_lens")  # light goes into them
REMEDY = "prototype.frame.uprights_mm or prototype.largest_ball_mm smaller"


def frame_layout(site: Site) -> FrameLayout:
    """The frame round a base and a stage; SpecError names what to change where it does not fit."""
    frame = FrameLayout(())
    for part in FRAME:
        if mounted := part.layout(site, frame):
            frame = FrameLayout((*frame.mounted, mounted))
    light, swept = _clearances(site, frame)
    return replace(frame, light=light, swept=swept)


def _clearances(site: Site, frame: FrameLayout) -> tuple[dict[str, float], dict[str, float]]:
    """Smallest distances of all static parts to light and to what the base sweeps."""
    keep_out, clearance = site.keep_out, site.spec.prototype.frame.clearance_mm
    bodies = (*frame.printed, *frame.purchased)
    static = {body.name: body.added for body in bodies if not body.rotates}
    light = {
        name: min_distance(keep_out.to_light, bodies)
        for name, bodies in static.items()
        if name not in MAY_BE_LIT
    }
    swept = {name: min_distance(keep_out.to_swept, bodies) for name, bodies in static.items()}
    obstacles = ("light of the balls", "balls and base as they swing")
    for obstacle, distances in zip(obstacles, (light, swept), strict=True):
        name, distance = min(distances.items(), key=lambda item: item[1])
        if distance < clearance:
            raise SpecError(
                f"{name.replace('_', ' ')}: {distance:.1f} mm from the {obstacle}, less than "
                f"prototype.frame.clearance_mm {clearance:g}: make {_remedy(name)}"
            )
    return light, swept


def _remedy(name: str) -> str:
    """What to change so that a body has more clearance."""
    remedies = (one for part in PARTS for one in part.remedies.items())
    return next((text for pattern, text in remedies if fnmatchcase(name, pattern)), REMEDY)

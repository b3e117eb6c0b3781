"""A target ray from several virtual cameras: each shows the point where the ray meets a surface.

Those virtual cameras are used that look at the point most nearly along the target ray; their
weights fall to zero at the first one that is not used, so that pictures are continuous (C.
Buehler and others, Unstructured Lumigraph Rendering, 2001, section 3). Each adds the pixels
about the point, weighted by a bell curve much narrower than they are: the pixels of several
cameras lie between each other, and together they are finer than one of them.

Its tests compare with a search among all cameras and all of their pixels.
"""

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.light.simulate.parallel import chunks, in_threads
from tbcad.light.simulate.views.pixels_about import (
    NOTHING,
    Point,
    linearise,
    nearest_at,
    sum_around,
    sum_between,
)
from tbcad.light.simulate.views.ray_bundle import (
    RAYS_PER_CHUNK,
    RAYS_PER_RUN,
    RayBundle,
    boxes_around,
    mirrors_near_boxes,
)
from tbcad.types import Bools, Bytes, Floats, Ints

# docs/decisions/0006: of 3 to 10 the best in PSNR and SSIM for the time they take.
CAMERAS = 6


def blend_cameras(bundle: RayBundle, targets: Floats, depth: Floats) -> tuple[Floats, Bools]:
    """Colours of target rays, and which were seen.

    Any order of the targets gives the same colours but for rounding; neighbours one after the
    other take less time.

    Args:
        bundle: captured rays; none is used that passes the point by more than the limit.
        targets: two-plane coordinates, (n, 4).
        depth: where each target meets the surface, along the direction of the view, over s, (n,).

    Returns:
        Colours (n, 3), 0 to 255, and whether any virtual camera showed the point, (n,).
    """

    def blended(part: slice) -> Floats:
        arrays = bundle.points, bundle.tiles, bundle.pinholes, bundle.colour
        return _blend(*arrays, targets[part], depth[part], bundle.limit)

    parts = in_threads(blended, chunks(len(targets), RAYS_PER_CHUNK))
    result = np.concatenate([np.zeros((0, 4)), *parts])
    return result[:, :3], result[:, 3] > 0


@compiled_loop
def _blend(
    points: Floats,
    tiles: Ints,
    pinholes: Floats,
    colour: Bytes,
    targets: Floats,
    depth: Floats,
    limit: float,
) -> Floats:
    """Colours and total weights of targets, (n, 4)."""
    boxes = boxes_around(targets, RAYS_PER_RUN)
    near_chunk = mirrors_near_boxes(pinholes, boxes, limit)
    near_chunk = near_chunk[tiles[near_chunk, 3] >= 0]
    last = tiles[:, 3].copy()
    result = np.zeros((len(targets), 4))
    chosen, angle2 = np.empty(CAMERAS + 1, dtype=np.int64), np.empty(CAMERAS + 1)
    local = np.empty((len(near_chunk), 12))
    for run in range(len(boxes)):
        stop = min((run + 1) * RAYS_PER_RUN, len(targets))
        near = _candidates(pinholes, near_chunk, boxes[run], depth[run * RAYS_PER_RUN : stop])
        even = np.zeros(len(near), dtype=np.bool_)  # whether `local` holds for a camera
        for i in range(run * RAYS_PER_RUN, stop):
            z, a, b = depth[i], targets[i, 2], targets[i, 3]
            point = targets[i, 0] + z * a, targets[i, 1] + z * b, z
            _choose(pinholes, near, point, a, b, chosen, angle2)
            for j in range(CAMERAS):
                c, weight = chosen[j], 1 - np.sqrt(angle2[j] / angle2[CAMERAS])
                if c < 0 or not weight > 0:
                    break  # so are all further ones
                k = near[c]
                width, known, more = tiles[k, 2], False, NOTHING
                if even[c]:
                    known, more = sum_between(
                        points, local, c, last[k], width, colour, point, limit
                    )
                if not known:
                    last[k] = nearest_at(points, width, last[k], point)
                    even[c] = linearise(points, width, last[k], local, c)
                    if even[c]:
                        known, more = sum_between(
                            points, local, c, last[k], width, colour, point, limit
                        )
                if not known:
                    more = sum_around(points, width, colour, last[k], point, limit)
                for channel in range(4):
                    result[i, channel] += weight * more[channel]
            if result[i, 3] > 0:
                for channel in range(3):
                    result[i, channel] /= result[i, 3]
    return result


@compiled_loop
def _candidates(pinholes: Floats, near: Ints, box: Floats, depth: Floats) -> Ints:
    """Those mirrors (c,) of some that a target in a box may be blended from, or weighted by.

    Args:
        pinholes: as in `RayBundle`, (k, 4).
        near: numbers of mirrors, (m,).
        box: middle and half sides of targets, (2, 4).
        depth: of the targets, (n,).
    """
    low, high = depth.min(), depth.max()
    least, most = np.empty(len(near)), np.empty(len(near))
    for j in range(len(near)):
        k = near[j]
        z = pinholes[k, 2]
        x = abs(box[0, 0] + z * box[0, 2] - pinholes[k, 0])
        y = abs(box[0, 1] + z * box[0, 3] - pinholes[k, 1])
        half_x, half_y = box[1, 0] + abs(z) * box[1, 2], box[1, 1] + abs(z) * box[1, 3]
        if high <= z:
            least[j] = most[j] = np.inf
            continue
        least[j] = np.hypot(max(x - half_x, 0.0), max(y - half_y, 0.0)) / (high - z)
        most[j] = np.hypot(x + half_x, y + half_y) / (low - z) if low > z else np.inf
    worst = np.partition(most, CAMERAS)[CAMERAS] if len(near) > CAMERAS else np.inf
    kept: Ints = near[(least <= worst) & (least < np.inf)]
    return kept


@compiled_loop
def _choose(
    pinholes: Floats, near: Ints, point: Point, a: float, b: float, chosen: Ints, angle2: Floats
) -> None:
    """Fill in which of some mirrors see a point most nearly along its target, the best first.

    Args:
        pinholes: as in `RayBundle`, (k, 4).
        near: numbers of mirrors, (c,).
        point: where the target meets the surface.
        a: slope of the target, over s.
        b: the other slope.
        chosen: places in `near`, -1 where there are too few.
        angle2: squared deviations from the target, infinite where there are too few.
    """
    for j in range(len(chosen)):
        chosen[j], angle2[j] = -1, np.inf
    for c in range(len(near)):
        k = near[c]
        ahead = point[2] - pinholes[k, 2]
        if ahead <= 0:
            continue
        across = (point[0] - pinholes[k, 0]) / ahead - a
        down = (point[1] - pinholes[k, 1]) / ahead - b
        deviation = across * across + down * down
        j = len(angle2) - 1
        if deviation >= angle2[j]:
            continue
        while j > 0 and angle2[j - 1] > deviation:
            angle2[j], chosen[j] = angle2[j - 1], chosen[j - 1]
            j -= 1
        angle2[j], chosen[j] = deviation, c

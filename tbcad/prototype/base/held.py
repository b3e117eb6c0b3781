"""How each ball and cap is held, in numbers: the force needed, and the force that there is."""

from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.caps import cap_pocket, cap_spigot
from tbcad.prototype.base.fasteners import seat_magnets
from tbcad.prototype.base.holding import (
    DERATING,
    GLUE_MPA,
    MIN_RATIO,
    REMANENCE_T,
    WIDER_GAP_MM,
    Motion,
    force_needed,
    glue_force,
    pull_of_pair,
    pull_on_ball,
)
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.balance import ball_masses
from tbcad.prototype.purchased.parts import Parts
from tbcad.records.prototype import HeldBall, Holding


def holding(base: BaseLayout, prototype: PrototypeLayout, motion: Motion, parts: Parts) -> Holding:
    """What holds each ball in its seat, with the pads as they are turned, and assumptions."""
    seats, masses = base.seats, ball_masses(prototype, motion.cap_density)
    needed = force_needed(
        seats.pad_normals, seats.axis, seats.centre, masses.mass_g, base.frame, motion
    ).tolist()
    held = (_forces(base, prototype, k) for k in range(len(seats)))
    rows = zip(needed, held, seat_magnets(base, parts), strict=True)
    return Holding(
        min_ratio=MIN_RATIO,
        remanence_t=REMANENCE_T,
        derating=DERATING,
        glue_mpa=GLUE_MPA,
        wider_gap_mm=WIDER_GAP_MM,
        balls=tuple(
            HeldBall(
                ball=number,
                by="glue" if wider is None else "magnet",
                magnet=magnet.name if magnet else None,
                force_needed_n=least,
                force_available_n=force,
                ratio=force / least,
                wider_gap_n=force if wider is None else wider,
            )
            for number, (least, (force, wider), magnet) in enumerate(rows, 1)
        ),
    )


def _forces(base: BaseLayout, prototype: PrototypeLayout, k: int) -> tuple[float, float | None]:
    """Force with the gap as drawn and with a wider one, N; None with glue."""
    seats, gap = base.seats, base.spec.magnet_gap_mm
    magnet, height = float(seats.magnet[k]) / 2, float(seats.magnet_height[k])
    if prototype.balls.cap[k] and magnet:
        own, own_height = cap_pocket(base, k, float(prototype.balls.body_depth[k]))
        own -= base.spec.magnet_play_mm / 2
        between = float(seats.radius[k]) + gap - cap_spigot(base, k)[1]
        if own > 0:
            pulls = [
                pull_of_pair(own, magnet, between + wider, (own_height, height))
                for wider in (0.0, WIDER_GAP_MM)
            ]
            return pulls[0], pulls[1]
    elif magnet:
        radius = float(seats.radius[k])
        pulls = [pull_on_ball(radius, gap + w, magnet, height) for w in (0.0, WIDER_GAP_MM)]
        return pulls[0], pulls[1]
    return float(glue_force(seats.pocket[k])), None

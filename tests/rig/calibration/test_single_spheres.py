"""Bounds of single spheres against those of the whole model, and layouts of LEDs."""

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.stage.leds import MIN_SEEN
from tbcad.rig.calibration.calibrate import Setup
from tbcad.rig.calibration.estimate.jacobian import highlights_with_slopes
from tbcad.rig.calibration.estimate.parameters import Block, covariance
from tbcad.rig.calibration.led_layout import (
    best_layout,
    layout_cost,
    led_room,
    ray_errors,
    shell_information,
    sphere_information,
    with_partners,
)
from tbcad.rig.calibration.priors import shell_prior
from tbcad.rig.calibration.study import whole_errors
from tbcad.rig.calibration.uncertainty import known_rays
from tbcad.rig.machine.designed import designed_shell, read_leds
from tbcad.tolerancing.process.process import load_process, process_errors

NOISE_PX, SIGMA_MM = 0.05, 0.025


def test_single_spheres_are_the_whole_model_with_all_else_fixed(export: ExportedDesign) -> None:
    leds = read_leds(export.folder)
    machine = designed_shell(export.reflectors[0], leds)
    count = len(machine.radius)
    every = np.ones((count, len(leds)), dtype=bool)
    information = sphere_information(machine.camera, machine.centre, machine.radius, leds, every)
    mm, mrad = ray_errors(information, [*range(len(leds))], NOISE_PX, (SIGMA_MM, SIGMA_MM))
    prior = shell_prior(machine, process_errors(load_process("sla")))
    for block, sigma in prior.sigma.items():
        sigma[:] = SIGMA_MM if block in (Block.CENTRES, Block.RADII) else 0
    seen = [one.ravel() for one in np.indices((1, count, len(leds)))]
    values = np.zeros(len(prior.free))
    _, slopes = highlights_with_slopes(prior, values, *seen)
    identity = diags_array(np.ones(len(values)))
    known = covariance(prior, csc_array(slopes.T @ slopes / NOISE_PX**2 + identity))
    rays = known_rays(prior, values, known, np.zeros(count, dtype=np.int64), np.arange(count))
    assert mm == pytest.approx(rays.whole.place_mm, rel=1e-6)
    assert mrad == pytest.approx(rays.whole.turn_mrad, rel=1e-6)


def test_best_layout_beats_others_and_keeps_to_the_room(export: ExportedDesign) -> None:
    room = led_room(export)
    places = room.places()
    information = shell_information(export, with_partners(places))
    best = best_layout(room, places, 4, lambda leds: layout_cost(information, leds))
    leds = with_partners(places)[best]
    assert np.sort(leds, axis=0) == pytest.approx(np.sort(leds * [-1, -1, 1], axis=0), abs=1e-9)
    assert (np.linalg.norm(leds, axis=1) <= room.outer).all()
    assert (np.hypot(leds[:, 0], leds[:, 1]) >= room.inner - 0.01).all()
    apart = np.linalg.norm(leds[:, None, :2] - leds[None, :, :2], axis=2)
    assert apart[np.triu_indices(4, 1)].min() >= room.apart
    cost = layout_cost(information, best)
    rng, p = np.random.default_rng(1), len(places)
    tried = [rng.choice(p, 2, replace=False) for _ in range(30)]
    fitting = [[*pair, *(pair + p)] for pair in tried if room.fits(places, [pair[0]], pair[1])]
    assert len(fitting) >= MIN_SEEN
    assert all(cost <= layout_cost(information, other) for other in fitting)


def test_less_noise_and_a_better_process_bound_rays_closer(setup: Setup) -> None:
    leds = setup.designed.leds
    usual = np.median(whole_errors(setup, leds, "fdm", 0.1).relative.place_mm)
    assert np.median(whole_errors(setup, leds, "fdm", 0.05).relative.place_mm) < usual
    assert np.median(whole_errors(setup, leds, "cnc", 0.1).relative.place_mm) < usual

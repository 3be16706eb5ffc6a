"""What must not change the event engine's answer: order, mirror, direction of time, cells; nothing
ever overlaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.catalogue import scenario
from tests.adapters.event_driven.gases import collisions_of, gas, state_after


def changed(scene, order=slice(None), flip=(1.0, 1.0)):
    """The scene with its disks in another order, or mirrored but for their angles and spins."""
    vectors = {name: getattr(scene, name) * flip for name in ("position", "velocity")}
    kept = ("radius", "mass", "inertia", "angle", "angular_velocity")
    disks = vectors | {name: getattr(scene, name) for name in kept}
    return replace(
        scene,
        **{name: values[order] for name, values in disks.items()},
        walls=scene.walls * flip,
        gravity=scene.gravity * flip,
        wrap=None if scene.wrap is None else np.sort(scene.wrap * flip, axis=0),
    )


@pytest.mark.parametrize(
    ("name", "until"), [("gas_of_100", 0.6), ("asteroids", 6.0), ("falling_box", 0.25)]
)
def test_order_and_mirror_do_not_matter(name, until):
    scene = scenario(name).scene
    _, x, v = state_after(scene, until)
    order = np.random.default_rng(3).permutation(scene.n)
    _, other, _ = state_after(changed(scene, order), until)
    # Rounding grows by the horizon's chaos: 1e-9 at the horizon, which lies a third beyond `until`.
    np.testing.assert_allclose(other, x[order], rtol=0, atol=1e-9)
    flip = np.array([-1.0, 1.0])
    _, other, speed = state_after(changed(scene, flip=flip), until)
    np.testing.assert_allclose(other * flip, x, rtol=0, atol=1e-9)
    np.testing.assert_allclose(speed * flip, v, rtol=0, atol=1e-7)


def test_time_runs_back_at_restitution_one():
    scene = scenario("gas_of_100").scene
    engine, x, v = state_after(scene, 0.45)
    _, back, speed = state_after(replace(scene, position=x, velocity=-v), 0.45)
    assert len(engine.collisions) > 100
    np.testing.assert_allclose(back, scene.position, rtol=0, atol=1e-8)
    np.testing.assert_allclose(-speed, scene.velocity, rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", ["gas_of_100", "asteroids", "falling_box", "a torus"])
def test_coarse_and_fine_cells_find_the_same_collisions(name):
    if name == "a torus":  # where three cells make the next image a neighbour on both sides
        (scene, torus), until, cells = gas(64, 0.3), 4.0, (0.0, 1.9, 99.0)
    else:
        one, torus, cells = scenario(name), None, (0.0, 0.37, 9.0)
        scene, until = one.scene, 0.7 * one.truth(one.times).t[-1]  # far before rounding shows
    lists = [
        [pair for _, *pair in collisions_of(state_after(scene, until, torus, cell)[0])]
        for cell in cells
    ]
    assert len(lists[0]) > (200 if torus is not None else 0)
    assert lists[0] == lists[1] == lists[2]


@pytest.mark.parametrize("packing", [0.1, 0.5])
def test_no_two_disks_ever_overlap(packing):
    scene, torus = gas(60, packing)
    engine, side = EventEngine(scene, torus), torus[1, 0]
    i, j = np.triu_indices(60, 1)
    for at in np.linspace(0, 300, 1001)[1:]:
        engine.advance(at)
        x, _ = engine.motion_at(at)
        apart = x[i] - x[j]
        apart -= side * np.round(apart / side)
        # A position is rounded at 20 m, and a time at 300 s moves it by 5e-14 m/s s: 1e-13.
        assert np.hypot(*apart.T).min() > 1 - 1e-12
        assert (np.abs(x / side - 0.5) < 0.5 + 1e-12).all()

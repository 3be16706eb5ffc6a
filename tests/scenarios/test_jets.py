"""A thrust that turns with its disk, in the oracle: against quadrature and the closed form."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scene, Thrust
from crosscheck2d.scenarios.truth.exact import computed
from crosscheck2d.scenarios.truth.oracle.numbers import mpfr
from tests.scenarios.test_oracle import asked, states

SPIN = {"angle": [0.7], "angular_velocity": [-3.0]}
ALONE = lay_out([[0.3, -0.2]], [1.0, 0.5], 0.25, 2.0, 0.5, gravity=[0.0, -9.8], **SPIN)


def quadrature(scene: Scene, thrusts: list[Thrust], until: float) -> np.ndarray:
    """(6,) x, y, vx, vy, angle, spin of disk 0 after `until` s, by Gauss in 100 steps a thrust."""
    nodes, weights = np.polynomial.legendre.leggauss(5)
    edges = sorted({0.0, until, *(t for p in thrusts for t in (p.start, p.stop) if t < until)})
    x, v = scene.position[0].copy(), scene.velocity[0].copy()
    angle, spin = scene.angle[0], scene.angular_velocity[0]
    for low, high in pairwise(edges):
        on = [p for p in thrusts if p.start <= low < p.stop]
        rate = sum(p.torque for p in on) / scene.inertia[0]
        world = scene.gravity + sum((p.force for p in on if p.frame == "world"), np.zeros(2)) / 2
        body = sum((p.force for p in on if p.frame == "body"), np.zeros(2)) / 2
        h = (high - low) / 100
        for _ in range(100):
            s = (nodes + 1) / 2 * h
            phi = angle + spin * s + rate * s**2 / 2
            a = world[:, None] + [
                body[0] * np.cos(phi) - body[1] * np.sin(phi),
                body[0] * np.sin(phi) + body[1] * np.cos(phi),
            ]
            x = x + v * h + (a * (h - s) * weights).sum(axis=1) * h / 2
            v = v + (a * weights).sum(axis=1) * h / 2
            angle, spin = angle + spin * h + rate * h * h / 2, spin + rate * h
    return np.array([*x, *v, angle, spin])


@pytest.mark.parametrize("kind", [None, mpfr])
def test_a_free_disk_is_followed_under_thrusts_and_torques(kind):
    thrusts = [
        Thrust(0, 0.0, 1.0, [3.0, -1.0], frame="body"),
        Thrust(0, 0.5, 1.5, [1.0, 2.0], torque=0.5),
        Thrust(0, 1.25, 2.0, [0.0, 5.0], torque=-0.25, frame="body"),
    ]
    one = asked(ALONE, 3.0, thrusts=thrusts)
    record = computed(one, kind)
    truth = states(one, record)

    assert (record.reason, len(truth.t)) == ("", len(one.times))
    for k, t in enumerate(truth.t.tolist()):
        expected = quadrature(ALONE, thrusts, t) if t else None
        if expected is not None:
            np.testing.assert_allclose(truth.position[k, 0], expected[:2], rtol=0, atol=1e-12)
            np.testing.assert_allclose(truth.velocity[k, 0], expected[2:4], rtol=0, atol=1e-12)
            np.testing.assert_allclose(truth.angle[k, 0], expected[4], rtol=0, atol=1e-12)


def test_the_oracle_agrees_with_the_closed_form_of_the_catalogue():
    one = scenario("body_frame_thrust")
    record = computed(one)
    expected = one.truth(one.times)
    np.testing.assert_allclose(
        states(one, record).position, expected.position, rtol=0, atol=record.error_bound + 1e-14
    )


def test_what_comes_after_the_thrust_is_answered():
    scene = lay_out(
        [[0, 3], [4, 3]],
        [[0, 0], [-1, 0]],
        mass=[2, 1],
        angular_velocity=[2, 0],
        gravity=[0, -9.8],
        walls=[[[-90, 0], [90, 0]]],
        restitution=0.5,
    )
    one = asked(scene, 4.0, thrusts=[Thrust(0, 0.0, 0.5, [1.0, 0.0], frame="body")])
    record = computed(one)
    assert (record.reason, record.float64_horizon) == ("", np.inf)
    assert states(one, record).position[-1, 0, 1] == pytest.approx(0.25, abs=1e-13)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_touch_while_it_acts_is_refused_in_one_sentence(friction: float):
    scene = replace(
        ALONE, position=[[0, 0.75]], velocity=[[0, 0]], walls=[[[-9, 0], [9, 0]]], friction=friction
    )
    one = asked(scene, 2.0, thrusts=[Thrust(0, 0.0, 1.0, [1.0, 0.0], frame="body")])
    record = computed(one)
    assert record.reason.startswith(
        "disk 0 touches wall 0 while a thrust that turns with it acts, and has no exact contact"
    )
    assert 0.3 < record.horizon < 0.34

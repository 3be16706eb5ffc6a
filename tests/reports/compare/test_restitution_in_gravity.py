"""Restitution under gravity: a collision's time is known to its step, and e no better than that."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.engine_row import FLOAT64
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.restitution import Restitutions, effective_restitution
from crosscheck2d.reports.compare.view import SLOWEST, Value, beside
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Collisions, Scene, Trajectory

G, SAMPLE = 9.81, 0.05  # m/s2, s
ROUNDING = 1e-12  # of some ten operations in float64


def fallen(e: float, stated: float, speed: float, share: float, substeps: int) -> Restitutions:
    """A disk meets a floor at `speed` m/s, `share` of a step before the end of the step that
    reports it, and leaves it at `e` times that speed; the scene states another e."""
    dt = SAMPLE / substeps
    t = SAMPLE * np.arange(4.0)
    end = t[1] + dt
    at = end - share * dt
    v = np.where(t < at, -speed - G * (t - at), e * speed - G * (t - at))
    still = np.zeros((4, 1))
    scene = Scene(
        position=[[0, 0.1]],
        velocity=[[0, v[0]]],
        radius=[0.1],
        mass=[1],
        gravity=[0, -G],
        restitution=stated,
        walls=[[[-9, 0], [9, 0]]],
    )
    played = Trajectory(
        t,
        np.zeros((4, 1, 2)),
        np.stack([still, v[:, None]], axis=-1),
        still,
        still,
        Collisions.of([(end, 0, -1, np.nan)]),
    )
    return effective_restitution(played, scene, dt, SLOWEST * G * SAMPLE, FLOAT64)


SPEEDS = st.floats(1.5 * SLOWEST * G * SAMPLE, 1000.0)
LAW = {"speed": SPEEDS, "share": st.floats(0, 0.99), "substeps": st.integers(1, 16)}


@given(e=st.floats(0, 1), **LAW)
def test_whoever_has_the_stated_e_reads_as_exact(
    e: float, speed: float, share: float, substeps: int
):
    found = fallen(e, e, speed, share, substeps)

    assert found.values == pytest.approx([e], abs=ROUNDING)


@given(e=st.floats(0, 1), stated=st.floats(0, 1), **LAW)
def test_another_e_is_read_to_the_fall_of_a_step(
    e: float, stated: float, speed: float, share: float, substeps: int
):
    # (1 + e) g dt / v, to second order; and never on the far side of what is stated.
    found = fallen(e, stated, speed, share, substeps)
    fall = G * SAMPLE / substeps / speed

    assert abs(found.values[0] - e) <= found.spread[0] + ROUNDING
    assert found.spread[0] == pytest.approx((1 + e) * fall, rel=2 * fall)
    assert min(e, stated) - ROUNDING <= found.values[0] <= max(e, stated) + ROUNDING


@given(**LAW)
def test_an_e_that_a_step_of_falling_cannot_explain_is_seen(
    speed: float, share: float, substeps: int
):
    found = fallen(0.3, 0.9, speed, share, substeps)

    assert abs(found.values[0] - 0.9) > 0.4


def read(engine: str) -> dict[str, Value | None]:
    """The two metrics of an engine that lets a ball bounce with e = 0.9."""
    one = scenario("bouncing_ball_e09")
    run = play(ENGINES[engine].make(), engine, one, one.dt(4))
    view = beside(one, run, None, None)
    return {name: METRICS[name].of(view) for name in ("restitution", "restitution_error")}


@pytest.mark.parametrize("engine", ["event_driven:float64", "reference:ordered"])
def test_who_follows_a_ball_exactly_has_its_e(engine: str):
    # They read 0.889 while the end of a step was taken for the time of the collision.
    found = read(engine)

    assert found["restitution"] is not None
    assert found["restitution"].value == pytest.approx(0.9, abs=ROUNDING)
    assert found["restitution"].note == "4 collisions read, e known to 0.02"
    assert found["restitution_error"] is not None
    assert found["restitution_error"].value < ROUNDING

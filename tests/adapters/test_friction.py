"""How the engines take friction: what they are given, what it mixes to, and what they make of it in
a bounce, each cause enabled and disabled."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from crosscheck2d.adapters.engines import ENGINES, told_apart
from crosscheck2d.adapters.mechanisms.table import (
    FRICTION,
    Mechanism,
    mechanisms_of,
    with_mechanisms,
)
from crosscheck2d.adapters.play import play
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario
from tests.reports.terminal.command_line import crosscheck

FLOAT32 = 2.0**-24
FLOOR = [[[-8.0, 0.0], [8.0, 0.0]]]
WITH_OPTION = [name for name in ENGINES if name.startswith(("pymunk", "box2d"))]  # friction=
OWN_DEFAULT = {"box2d:shipped": 0.2, "box2d_v3:shipped": 0.6}  # of who states no friction


def thrown(e, mu):
    """A solid disk of 1 kg and 0.25 m that meets a floor at (5, -5) m/s, for half a second."""
    scene = lay_out([[0.0, 1.0]], [[5.0, -5.0]], restitution=e, friction=mu, walls=FLOOR)
    return Scenario("thrown", "How does it leave?", "here", scene, 0.5, 0.25, (15, 240))


def left_with(engine, asked, rate):
    """The velocity along the floor in m/s and the clockwise spin in rad/s after the bounce."""
    run = play(engine, "one:engine", asked, 1 / rate)
    assert run.status == "ok", run.reason
    end = run.trajectory.at(-1)
    return end.velocity[0, 0], -end.angular_velocity[0]


BOX2D = "box2d:shipped"
BOX2D_V3 = "box2d_v3:shipped"
PYMUNK = "pymunk:matched"
MEASURED = [
    # e, friction, engine, steps a second, m/s along the floor, rad/s
    *((e, 0.1, PYMUNK, 60, 5 - 0.5 * (1 + e), 4 * (1 + e)) for e in (0.0, 0.5, 1.0)),
    (1.0, 0.5, PYMUNK, 60, 3.333, 13.333),
    (0.0, 0.1, BOX2D, 60, 4.5, 3.920),
    (0.0, 0.1, BOX2D, 960, 4.5, 3.962),
    (0.5, 0.1, BOX2D, 60, 4.25, 5.880),
    (0.5, 0.1, BOX2D, 960, 4.25, 5.943),
    (1.0, 0.1, BOX2D, 60, 4.0, 7.840),
    (1.0, 0.1, BOX2D, 960, 4.0, 7.923),
    (1.0, 0.5, BOX2D, 60, 3.288, 13.421),
    (1.0, 0.5, BOX2D, 960, 3.312, 13.376),
    (0.0, 0.1, BOX2D_V3, 60, 4.5, 4.0),
    (0.0, 0.1, BOX2D_V3, 960, 4.5, 4.042),
    (0.5, 0.1, BOX2D_V3, 60, 4.501, 3.993),
    (0.5, 0.1, BOX2D_V3, 960, 4.5, 4.038),
    (1.0, 0.1, BOX2D_V3, 60, 4.501, 3.993),
    (1.0, 0.1, BOX2D_V3, 960, 4.5, 4.038),
    (1.0, 0.5, BOX2D_V3, 60, 3.333, 13.333),
    (1.0, 0.5, BOX2D_V3, 960, 3.356, 13.286),
]


@pytest.mark.parametrize(("e", "mu", "name", "rate", "along", "spin"), MEASURED)
def test_an_engine_leaves_a_floor_as_it_was_measured(e, mu, name, rate, along, spin):
    # The digits that are given; in Box2D 3.1 the rounding of the floor's length is as much.
    assert left_with(ENGINES[name].make(), thrown(e, mu), rate) == (
        pytest.approx(along, abs=0.001),
        pytest.approx(spin, abs=0.001),
    )


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_the_friction_of_box2d_2_acts_in_the_middle_between_floor_and_disk(e):
    # Half of the overlap of disk and skin nearer than the radius: continuous collision stops the
    # disk within the skin, which is 0.01 m thick.
    for rate in (60, 960):
        along, spin = left_with(ENGINES[BOX2D].make(), thrown(e, 0.1), rate)
        J = 0.5 * (1 + e)
        assert along == pytest.approx(5 - J, rel=8 * FLOAT32)
        arm = spin / J / 32
        assert 0.25 - 0.01 / 2 - 1e-6 <= arm <= 0.25 - 0.01 / 5


ABLATIONS = [
    # engine, steps a second, e, friction; what is turned off; how much spin in rad/s it explains
    ("box2d_v3:shipped", 60, 1.0, 0.1, {"rub_restituted": True}, 4.0),
    ("box2d_v3:shipped", 60, 0.5, 0.1, {"rub_restituted": True}, 2.0),
    ("box2d_v3:matched", 960, 1.0, 0.1, {"rub_restituted": True}, 4.0),
    ("box2d_v3:shipped", 960, 1.0, 0.5, {"lever": 0.0}, 0.047),
    ("box2d_v3:shipped", 60, 1.0, 0.1, {"carried": False}, 0.0067),
    ("box2d:shipped", 60, 1.0, 0.1, {"lever": 0.0}, 0.16),
    ("box2d:shipped", 960, 0.5, 0.1, {"lever": 0.0}, 0.057),
    ("pymunk:shipped", 60, 1.0, 0.1, {"friction": None}, 7.2),
]


@pytest.mark.parametrize(("name", "rate", "e", "mu", "off", "explained"), ABLATIONS)
def test_each_cause_is_shown_by_an_ablation(name, rate, e, mu, off, explained):
    asked = thrown(e, mu)
    run = play(ENGINES[name].make(), name, asked, 1 / rate)
    mechanisms = mechanisms_of(name, run.settings, asked.scene, 1 / rate)
    engine = np.array(left_with(ENGINES[name].make(), asked, rate))
    on = np.array(left_with(with_mechanisms(mechanisms), asked, rate))
    without = [*mechanisms, Mechanism(FRICTION, off)]
    gone = np.array(left_with(with_mechanisms(without), asked, rate))

    # Box2D 3.1 is float32, in places of 4 m; a place decides whether 1 mm more is a contact.
    rounding = {"pymunk": 1e-12, "box2d": 4e-6, "box2d_v3": 5e-4}[name.split(":")[0]]
    assert np.abs(on - engine).max() <= rounding
    assert np.abs(gone - engine)[1] == pytest.approx(explained, rel=0.02, abs=rounding)


@pytest.mark.parametrize("name", WITH_OPTION)
def test_a_scene_without_friction_is_played_as_before(name):
    for scene in (scenario("oblique_e09"), scenario("box_billiard")):
        friction = OWN_DEFAULT.get(name, 0.0)
        plain, stated = (
            play(make(), name, scene, scene.dt(2)).trajectory
            for make in (ENGINES[name].make, partial(ENGINES[name].make, friction=friction))
        )
        assert plain.position.tobytes() == stated.position.tobytes()
        assert plain.angular_velocity.tobytes() == stated.angular_velocity.tobytes()
        rough = play(ENGINES[name].make(friction=0.01), name, scene, scene.dt(2)).trajectory
        assert rough.position.tobytes() != plain.position.tobytes()


def test_an_engine_that_is_another_without_friction_is_played_beside_it_only_with_friction():
    rows, rough = ENGINES, thrown(0.5, 0.2).scene
    smooth = thrown(0.5, 0.0).scene
    assert set(rows) - set(told_apart(rows, smooth)) == {"reference:coulomb"}
    assert told_apart(rows, rough) == list(rows)
    alone = {"reference:coulomb": rows["reference:coulomb"]}
    assert told_apart(alone, smooth) == ["reference:coulomb"]


def test_what_has_limits_of_its_own_is_driven_to_them(tmp_path):
    asked = ("slow_collision", "touching_break", "--engine", "reference:coulomb")
    refused = crosscheck("stability", *asked, cwd=tmp_path)
    assert refused.returncode == 2
    assert "--engine reference:coulomb: plays as reference:exercise here" in refused.stderr

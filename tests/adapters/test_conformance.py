"""The conformance suite catches what it is there to catch, and finds in the real engines what is
known of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from math import atan, sqrt

import pytest

from crosscheck2d.adapters.conformance.conform import PROBES, conform
from crosscheck2d.adapters.conformance.probe import loaded, one_disk
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.table import (
    FRICTION,
    Mechanism,
    mechanisms_of,
    with_mechanisms,
)
from tests.adapters.broken_engines import CAUGHT_BY, RaisesInStep, RefusesAll, Sound, row_of
from tests.tolerances import DEPARTURES


@cache
def findings_of(name):
    return {finding.probe: finding for finding in conform(name, ENGINES[name])}


def found_in(make):
    return {finding.probe: finding for finding in conform("broken:one", row_of(make))}


@pytest.mark.parametrize("name", ENGINES)
def test_no_engine_breaks_the_protocol(name):
    assert [finding for finding in findings_of(name).values() if finding.verdict == "breaks"] == []


@pytest.mark.parametrize("name", ENGINES)
def test_the_departures_of_an_engine_are_exactly_those_in_the_table(name):
    known = {departure.probe for departure in DEPARTURES if departure.engine == name}
    found = {probe for probe, finding in findings_of(name).items() if finding.verdict != "keeps"}
    table, new, gone = "DEPARTURES of tests/tolerances.py", sorted(found - known), known - found
    assert not new, f'{table} lacks {new} (the value of a probe that is refused is "refused")'
    assert not gone, f"{table} has probes that are kept now: {sorted(gone)}"


@pytest.mark.parametrize("departure", DEPARTURES, ids=lambda d: f"{d.engine}-{d.probe}")
def test_a_departure_is_as_large_as_its_cause_makes_it(departure):
    finding = findings_of(departure.engine)[departure.probe]
    if isinstance(departure.value, str):
        assert finding.got == departure.value
        return
    assert abs(finding.got - departure.value) <= departure.bound
    assert abs(departure.value - finding.expected) > finding.bound + departure.bound


# Each cause is turned off alone: the departure must go with it.


def give_each_shape_the_root(engine):
    for shape in engine.index:
        shape.elasticity = sqrt(engine.scene.restitution)


def smooth_box2d(engine):
    for body in engine.bodies:
        for fixture in body.fixtures:
            fixture.friction = 0.0


def smooth_box2d_v3(engine):
    for body in engine.bodies:
        for shape in body.shapes:
            shape.friction = 0.0


def give_each_shape_the_root_of_friction(engine):
    for shape in engine.index:
        shape.friction = sqrt(engine.scene.friction)


def setting(name, value):
    return lambda engine: setattr(engine.world, name, value)


NO_THRESHOLD = setting("restitution_threshold", 0.0)
SETTINGS_OF_PROBES = {
    ("pymunk:shipped", "restitution_0.01"): give_each_shape_the_root,
    ("pymunk:shipped", "restitution_100"): give_each_shape_the_root,
    ("pymunk:shipped", "restitution_wall"): give_each_shape_the_root,
    ("pymunk:shipped", "friction_0.5"): give_each_shape_the_root_of_friction,
    ("pymunk:shipped", "friction_at_rest"): give_each_shape_the_root_of_friction,
    ("box2d:shipped", "slow_flight"): lambda engine: engine.world.SetAllowSleeping(False),
    ("box2d:shipped", "friction"): smooth_box2d,
    ("box2d_v3:shipped", "slow_flight"): setting("sleeping_enabled", False),
    ("box2d_v3:shipped", "friction"): smooth_box2d_v3,
    ("box2d_v3:shipped", "restitution_0.01"): NO_THRESHOLD,
    ("box2d_v3:shipped", "restitution_0.5"): NO_THRESHOLD,
}


def tuned(row, tune):
    def make():
        engine = row.make()
        load = engine.load

        def load_and_tune(scene, dt):
            load(scene, dt)
            tune(engine)

        engine.load = load_and_tune
        return engine

    return replace(row, make=make)


@pytest.mark.parametrize(("name", "probe"), SETTINGS_OF_PROBES)
def test_a_departure_goes_when_its_cause_is_turned_off(name, probe):
    reading = PROBES[probe].read(tuned(ENGINES[name], SETTINGS_OF_PROBES[name, probe]))
    assert reading.kept, reading


def test_the_speed_limit_of_box2d_v3_goes_with_its_option():
    # It is fixed when the world is made, so it is turned off before.

    def make():
        engine = ENGINES["box2d_v3:shipped"].make()
        engine._options = lambda: {"maximum_linear_speed": 1e9}
        return engine

    assert PROBES["fast_flight"].read(replace(ENGINES["box2d_v3:shipped"], make=make)).kept


@pytest.mark.parametrize("dt", [1 / 32, 1 / 64, 1 / 128])
def test_box2d_moves_a_disk_by_at_most_two_metres_a_step(dt):
    # The cap is on the way, so half the dt doubles the speed; matched has units as long as half of
    # it.
    for name, speed in (("box2d:shipped", 2 / dt), ("box2d:matched", 512.0)):
        with loaded(ENGINES[name], one_disk(velocity=(512.0, 0.0)), dt=dt) as engine:
            engine.step()
            # The cut is one float32 ratio and product.
            assert engine.read().velocity[0, 0] == pytest.approx(speed, rel=4 * 2.0**-24)


@pytest.mark.parametrize("substeps_in_1s", [512, 1024, 2048, 4096])
def test_box2d_v3_turns_by_the_arc_tangent_a_substep(substeps_in_1s):
    # Normalised Euler: short by (w h)2 / 3 of the angle, so half the dt leaves a quarter.
    steps, spin = substeps_in_1s // 4, 20.0
    with loaded(ENGINES["box2d_v3:matched"], one_disk(spin=spin), dt=1 / steps) as engine:
        for _ in range(16):
            engine.step(steps // 16)
            angle = engine.read().angle[0]
    exact = substeps_in_1s * atan(spin / substeps_in_1s)
    assert abs(angle - exact) <= substeps_in_1s * 2.0**-24  # cos and sin round once a substep


class AsBox2DV3:
    """The reference with the mechanisms of Box2D 3.1 but one."""

    def __init__(self, **left_out):
        self.left_out = Mechanism(FRICTION, left_out)

    def load(self, scene, dt):
        with loaded(ENGINES["box2d_v3:matched"], scene, dt) as engine:
            mechanisms = mechanisms_of("box2d_v3:matched", engine.settings(), scene, dt)
        self.engine = with_mechanisms([*mechanisms, self.left_out])
        self.engine.load(scene, dt)
        self.step, self.read, self.close = self.engine.step, self.engine.read, self.engine.close


@pytest.mark.parametrize(
    ("probe", "left_out"),
    [
        ("friction_0.5", {"rub_restituted": True}),
        ("friction_1", {"rub_restituted": True}),
        ("friction_at_rest", {"carried": False}),
    ],
)
def test_a_departure_of_the_friction_of_box2d_v3_goes_with_its_mechanism(probe, left_out):
    found = findings_of("box2d_v3:matched")[probe].got
    row = ENGINES["box2d_v3:matched"]
    with_all = PROBES[probe].read(replace(row, make=AsBox2DV3))
    # as in the table of departures
    assert with_all.got == pytest.approx(found, abs=1e-5)
    assert PROBES[probe].read(replace(row, make=partial(AsBox2DV3, **left_out))).kept


@pytest.mark.parametrize("fault", CAUGHT_BY)
def test_a_broken_adapter_is_caught_by_the_probe_meant_for_it(fault):
    broken, probe = CAUGHT_BY[fault]
    finding = found_in(broken)[probe]
    assert finding.verdict == PROBES[finding.probe].failure
    assert finding.got != "raised"


def test_every_probe_that_can_find_a_broken_protocol_has_a_broken_adapter():
    of_protocol = {name for name, probe in PROBES.items() if probe.failure == "breaks"}
    assert of_protocol <= {probe for _, probe in CAUGHT_BY.values()}


def test_the_untouched_reference_keeps_everything():
    assert {finding.verdict for finding in found_in(Sound).values()} == {"keeps"}


def test_an_exception_is_a_finding_with_its_message():
    found = found_in(RaisesInStep)
    assert list(found) == list(PROBES)
    assert found["order_and_shapes"].verdict == "keeps"
    assert found["stays_finite"].verdict == "breaks"
    assert found["stays_finite"].note == "RuntimeError: island solver ran out of memory"


def test_a_refusal_is_not_asked_and_says_why():
    found = found_in(RefusesAll).values()
    assert {(finding.verdict, finding.note) for finding in found} == {
        ("not asked", "no disks here")
    }


def test_a_missing_library_is_one_finding_with_its_name():
    def make():
        raise ModuleNotFoundError("No module named 'chipmunk5'", name="chipmunk5")

    (finding,) = conform("broken:one", row_of(make))
    assert (finding.probe, finding.verdict) == ("make", "breaks")
    assert "chipmunk5" in finding.note


def test_every_engine_that_is_made_is_closed():
    # Box2D v3 has room for 128 worlds in a process.
    alive = []

    class Counted(RaisesInStep):
        def __init__(self):
            super().__init__()
            alive.append(self)

        def close(self):
            alive.remove(self)

    conform("broken:one", row_of(Counted))
    assert alive == []

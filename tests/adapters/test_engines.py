"""What `play` makes of every engine: exact impulses, the exercise's wrap, refusals, runaways,
repeats."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crosscheck2d.adapters.advance import thrust_steps
from crosscheck2d.adapters.conformance.probe import (
    first_difference,
    history,
    loaded,
    one_disk,
    plain,
)
from crosscheck2d.adapters.engine import NOT_REPORTED, Unsupported
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms import ablated_reference
from crosscheck2d.adapters.play import play, play_once
from crosscheck2d.adapters.reference import METHODS, Reference
from crosscheck2d.adapters.run import STATUSES
from crosscheck2d.reference_impl import exercise
from crosscheck2d.reference_impl.blocks import ADVANCE
from crosscheck2d.reports.run.cells import Cell
from crosscheck2d.reports.run.playing import play_cell
from crosscheck2d.scenarios.catalogue import scenario as from_catalogue
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario, Thrust
from tests.adapters.broken_engines import NanAtStep7, RaisesInStep

FLOAT32_ENGINES = [name for name, row in ENGINES.items() if row.rounding > 2.0**-53]
BOX = [[-5.0, -3.0], [5.0, 3.0]]  # of the exercise


def asked(scene, thrusts=(), duration=1.0, sample_interval=0.1):
    return Scenario(
        "probe", "What happens?", "here", scene, duration, sample_interval, thrusts=thrusts
    )


def played(name, scenario, dt):
    return play_once(ENGINES[name].make, name, scenario, dt)


def played_or_skipped(name, scenario, dt):
    run = played(name, scenario, dt)
    if run.status == "unsupported":
        pytest.skip(run.reason)
    return run


@contextmanager
def or_skipped():
    try:
        yield
    except Unsupported as refusal:
        pytest.skip(str(refusal))


def arrays(trajectory):
    fields = vars(trajectory) | vars(trajectory.collisions)
    return [array.tobytes() for array in fields.values() if isinstance(array, np.ndarray)]


@pytest.mark.parametrize("name", ENGINES)
def test_a_thrust_that_starts_and_stops_inside_steps_gives_its_exact_impulse(name):
    thrust = Thrust(0, 0.013, 0.687, [3.0, -2.0], torque=0.4)
    end = played(name, asked(one_disk(), [thrust]), 0.02).trajectory.at(-1)
    seconds, digits = 0.687 - 0.013, ENGINES[name].rounding
    # A force and a velocity round in each of 35 steps.
    assert end.velocity[0] == pytest.approx(seconds * thrust.force / 7.3, rel=2 * 35 * digits)
    assert end.angular_velocity[0] == pytest.approx(seconds * 0.4 / 0.9, rel=2 * 35 * digits)


@pytest.mark.parametrize("name", ENGINES)
def test_a_body_frame_thrust_turns_with_the_disk(name):
    scene = replace(one_disk(), angle=np.array([np.pi / 2]))
    thrust = Thrust(0, 0.0, 1.0, [7.3, 0.0], frame="body")
    end = played(name, asked(scene, [thrust]), 0.05).trajectory.at(-1)
    # The angle, pi / 2, is known to a rounding, which turns the force; each of 20 steps rounds a
    # velocity.
    assert end.velocity[0] == pytest.approx([0.0, 1.0], abs=(2 + 2 * 20) * ENGINES[name].rounding)


@settings(derandomize=True)
@given(
    start=st.floats(0, 3),
    lasts=st.floats(0.001, 3),
    dt=st.sampled_from([0.01, 0.05, 1 / 64]),
    at_once=st.integers(1, 9),
)
def test_the_shares_of_a_thrust_add_up_to_its_length(start, lasts, dt, at_once):
    thrust = Thrust(0, start, start + lasts, [1.0, 0.0])
    steps = at_once * (int((start + lasts) / dt / at_once) + 1)
    cuts = [
        cut
        for first in range(0, steps, at_once)
        for cut in thrust_steps([thrust], first, at_once, dt)
    ]
    assert sum(count for count, _ in cuts) == steps
    shares = sum(share for _, acting in cuts for _, share in acting)
    # The first and the last share may be dropped below 1e-9; start / dt rounds at 300 steps of
    # 2^-53.
    assert abs(shares * dt - lasts) <= 2e-9 * dt + 300 * 2.0**-53


@pytest.mark.parametrize("name", ENGINES)
def test_an_engine_plays_friction_or_says_that_it_does_not(name):
    one = from_catalogue("slip_to_roll")
    run = played(name, one, one.dt(1))
    if run.status == "unsupported":
        assert "does not model friction, the scene has 0.2" in run.reason
        assert run.frictionless
    else:
        assert run.trajectory is not None
        # By the exact answer it rolls at 8 rad/s. pymunk as shipped has friction 0.2 times 0.2, and
        # turns at 2 mu g t / r = 4.7 rad/s after 1.5 s.
        assert -10 < run.trajectory.angular_velocity[-1, 0] < -4


@pytest.mark.parametrize("name", ENGINES)
def test_disks_do_not_see_each_other_across_the_edge_but_meet_after_it(name):
    scene = lay_out([[4.9, 0.0], [-4.2, 0.0]], [[2.0, 0.0], [0.0, 0.0]], wrap=BOX)
    apart = replace(scene, position=np.array([[4.9, 0.0], [-4.9, 0.0]]), velocity=np.zeros((2, 2)))
    still = played_or_skipped(name, asked(apart), 0.0125).trajectory
    assert len(still.collisions) == 0
    # Nothing moves: the start is rounded to float32 once, and the unit of length once more.
    assert np.abs(still.position - apart.position).max() <= 2 * ENGINES[name].rounding * 5
    run = played(name, asked(scene), 0.0125)
    if run.silent:
        pytest.skip("it reports no collisions")
    met = run.trajectory
    assert (met.collisions.i.tolist(), met.collisions.j.tolist()) == ([0], [1])
    # It leaves at 0.05 s and the gap of 0.3 m is closed 0.15 s later; a step to find it, and one to
    # leave.
    assert met.collisions.t[0] == pytest.approx(0.2, abs=2 * 0.0125)


@pytest.mark.parametrize("name", FLOAT32_ENGINES)
@pytest.mark.parametrize(
    "change",
    [
        {"mass": [1e39]},
        {"inertia": [1e-46]},
        {"gravity": [0.0, -1e39]},
        {"walls": [[[-1e39, -1.0], [1e39, -1.0]]]},
    ],
    ids=lambda change: next(iter(change)),
)
def test_a_value_beyond_float32_is_refused_with_its_name(name, change):
    scene = replace(one_disk(), **{key: np.array(value) for key, value in change.items()})
    run = played(name, asked(scene), 0.1)
    assert run.status == "unsupported"
    assert run.reason.startswith(next(iter(change)))
    assert run.reason.endswith("does not fit into float32")
    assert run.trajectory is None


@pytest.mark.parametrize(
    "change", [{"velocity": [[1e37, 0.0]]}, {"gravity": [0.0, 1e34]}, {"position": [[2e38, 0.0]]}]
)
def test_a_value_beyond_float32_in_the_units_of_matched_box2d_is_refused(change):
    # It fits as the scene states it, and does not once the unit of time is 1000 s and that of
    # length 0.5 m.
    scene = replace(one_disk(), **{key: np.array(value) for key, value in change.items()})
    run = played("box2d:matched", asked(scene), 0.1)
    assert run.status == "unsupported"
    assert run.reason.endswith("does not fit into float32")


@pytest.mark.parametrize(
    ("name", "library"),
    [("pymunk:shipped", "pymunk"), ("box2d:matched", "Box2D"), ("box2d_v3:shipped", "pyb2d3")],
)
def test_a_missing_library_is_a_refusal_with_its_name(name, library, monkeypatch):
    adapter = f"crosscheck2d.adapters.{name.split(':')[0]}"
    monkeypatch.delitem(sys.modules, adapter, raising=False)
    monkeypatch.setitem(sys.modules, library, None)
    run = play_cell(Cell("free_fall", 1, name, 1), ENGINES[name], from_catalogue("free_fall"))
    assert (run.name, run.status, run.trajectory) == (name, "unsupported", None)
    assert run.reason.startswith(f"{library} cannot be imported: ")


@pytest.mark.parametrize(
    "name", ["reference:exercise", "reference:lesson", "pymunk:shipped", "pymunk:matched"]
)
def test_a_fast_disk_is_no_runaway(name):
    run = played(name, asked(one_disk(velocity=(4e9, 0.0))), 0.05)
    assert run.status == "ok"


class Thrower(Reference):
    def step(self, count=1):
        super().step(count)
        self.disks.velocity[:] *= 10.0


def test_a_disk_thrown_by_its_engine_is_diverged_and_says_how_far_and_when():
    run = play(Thrower(exercise), "broken:thrower", asked(one_disk(velocity=(1.0, 0.0))), 0.1)
    assert run.status == "diverged"
    assert (
        run.reason == f"a disk is {run_away(len(run.trajectory)):.3g} m away at"
        f" {0.1 * len(run.trajectory):g} s"
    )


def run_away(steps: int) -> float:
    """m: the start, and 0.1 s at each of 1, 10, 100, ... m/s."""
    return 0.25 + 0.1 * sum(10.0**k for k in range(steps))


def test_a_number_that_is_not_finite_is_diverged_and_says_which_and_when():
    # Step 7 of 0.05 s is in the interval that ends at 0.4 s.
    run = play(NanAtStep7(), "broken:nan", asked(one_disk()), 0.05)
    assert (run.status, run.reason) == ("diverged", "position of disk 0 is not finite at 0.4 s")
    assert len(run.trajectory) == 4


def test_an_engine_that_raises_is_an_error_with_its_message():
    run = play(RaisesInStep(), "broken:raises", asked(one_disk()), 0.05)
    assert (run.status, run.reason) == ("error", "RuntimeError: island solver ran out of memory")
    assert len(run.trajectory) == 1
    assert run.status in STATUSES


def test_a_dt_that_does_not_divide_the_sample_interval_is_not_played():
    with pytest.raises(ValueError, match=r"0\.03 s does not divide the sample interval 0\.1 s"):
        played("reference:exercise", asked(one_disk()), 0.03)


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("e", [0.5, 1.0])
def test_what_was_asked_of_an_engine_is_what_it_resolved(name, e):
    scene = replace(plain(), restitution=e)
    with or_skipped(), loaded(ENGINES[name], scene) as engine:
        settings, versions = engine.settings(), engine.versions()
    assert settings
    assert versions
    for setting, (wanted, resolved) in settings.items():
        assert resolved is not None, setting
        if resolved in NOT_REPORTED or resolved == "no wall":
            continue
        if isinstance(wanted, float):
            assert resolved == pytest.approx(wanted, rel=2.0**-23), setting  # float32
        elif wanted is not None:
            assert resolved == wanted, setting


HAND_WRITTEN = [name for name in ENGINES if name.startswith("reference:")]


def test_a_hand_written_solver_says_its_integrator_and_is_entered_with_two_arrays():
    solvers = {name: ENGINES[name].make() for name in HAND_WRITTEN}

    assert all(isinstance(solver, Reference) for solver in solvers.values())
    assert [name for name, solver in solvers.items() if solver.name not in METHODS] == []
    assert [n for n, solver in solvers.items() if solver.variant.__name__ not in ADVANCE] == []
    # the control: a module of another folder, which `Reference` plays, too
    assert Reference(ablated_reference).name not in METHODS
    assert ablated_reference.__name__ not in ADVANCE


def test_box2d_v3_reads_its_length_unit_off_the_engine():
    # Off a default that is a multiple of it; negative control: what was asked for is not simply
    # repeated.
    import pyb2d3

    with loaded(ENGINES["box2d_v3:matched"], plain()) as engine:
        asked, used = engine.settings()["length unit in m"]
        assert used == pytest.approx(asked, rel=2.0**-23)  # times 400 and back in float32
        engine.unit = 17.0
        assert engine.settings()["length unit in m"] == (17.0, used)
        pyb2d3.set_length_units_per_meter(1.0)


@pytest.mark.parametrize("name", ENGINES)
def test_a_setting_that_cannot_be_read_back_says_so(name):
    with or_skipped(), loaded(ENGINES[name], plain()) as engine:
        settings = engine.settings()
    for setting in ("substeps", "velocity, position iterations"):
        if setting in settings and "box2d" in name:
            assert settings[setting][1] == "passed with every step"
    if name == "box2d_v3:matched":
        assert (
            settings["contact tuning (hertz, damping ratio, push speed in m/s)"][1]
            == "not readable"
        )


@pytest.mark.parametrize("name", ["box2d:shipped", "box2d:matched"])
def test_box2d_tells_its_own_sleep_setting(name):
    # `world.allowSleeping` of box2d-py 2.3.8 is an attribute of the Python object that the engine
    # never sees.
    with loaded(ENGINES[name], plain()) as engine:
        assert (
            engine.settings()["sleeping"][1]
            == engine.world.GetAllowSleeping()
            == (name == "box2d:shipped")
        )


@pytest.mark.parametrize("name", ENGINES)
def test_an_engine_repeats_itself_bit_for_bit(name):
    scenario = replace(
        from_catalogue("asteroids", 1), thrusts=[Thrust(0, 0.11, 0.63, [0.2, 0.1], torque=0.05)]
    )
    scenario = replace(scenario, duration=20 * scenario.sample_interval)
    once, again = (
        played_or_skipped(name, scenario, scenario.sample_interval / 2) for _ in range(2)
    )
    assert once.status == "ok"
    assert arrays(once.trajectory) == arrays(again.trajectory)
    assert once.trajectory.t.tolist() == scenario.times.tolist()


def test_all_engines_at_once_play_as_each_alone():
    alone, together = {}, {}
    for name, row in ENGINES.items():
        with loaded(row, plain()) as engine:
            alone[name] = history(engine)
    engines = {name: row.make() for name, row in ENGINES.items()}
    for engine in engines.values():
        engine.load(plain(), 1 / 256)
    for name, engine in engines.items():
        together[name] = history(engine)
    for engine in engines.values():
        engine.close()
    assert {
        name: first_difference(together[name], alone[name]) for name in ENGINES
    } == dict.fromkeys(ENGINES, "nowhere")

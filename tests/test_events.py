"""The event engine against closed forms, a second algorithm, symmetries, conservation laws and the literature."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from gases import compressibility, gas
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios import events
from scenarios.catalogue import SCENARIOS, scenario
from scenarios.event_truth import float64_truth
from scenarios.events import EventEngine
from scenarios.model import Scenario, Scene, Thrust
from scenarios.no_truth import NoTruth
from scenarios.oracle import OracleTruth
from scenarios.placing import box, scatter

REFUSED = {
    "rest_on_floor": "accumulate",
    "slide_on_incline": "accumulate",
    "column_of_ten": "accumulate",
    "body_frame_thrust": "turns with its disk",
}
ANSWERED = [name for name in SCENARIOS if scenario(name).truth and name not in REFUSED]


@pytest.mark.parametrize("name", ANSWERED)
def test_the_closed_forms_are_met_up_to_the_horizon(name):
    """States and lists of hits, to a few roundings, which chaos makes a thousand: far within the 1e-9 m claimed.

    The truth is the closed form, or the oracle in many digits, which shares no algorithm with the event engine.
    """
    run = scenario(name)
    exact, truth = run.truth(run.times), float64_truth(run)
    found = truth(run.times)
    k = min(len(exact), len(found))
    assert found.t[k - 1] == exact.t[k - 1]
    chaos = 1e3 if isinstance(run.truth, OracleTruth) else 1.0
    for field, tolerance in (("position", 1e-12), ("velocity", 2e-12), ("angle", 1e-14), ("angular_velocity", 1e-14)):
        np.testing.assert_allclose(getattr(found, field)[:k], getattr(exact, field)[:k], rtol=0, atol=chaos * tolerance)
    told, listed = found.collisions, exact.collisions
    last = min(found.t[k - 1], 8.0 if name == "bouncing_ball_e09" else np.inf)  # it lists only hits 1e-4 s apart
    h = int((listed.t <= last).sum())
    assert h == (told.t <= last).sum()
    pairs = [sorted(zip(np.round(c.t[:h], 8), c.i[:h], c.j[:h])) for c in (told, listed)]  # 49 balls hit at once
    assert pairs[0] == pairs[1]
    np.testing.assert_allclose(told.impulse[:h], listed.impulse[:h], rtol=1e-11, atol=chaos * 1e-12)


@pytest.mark.parametrize("name", ["free_fall", "galperin_3", "ping_pong", "mass_ratios", "line_gas"])
def test_where_nothing_is_chaotic_the_horizon_is_the_duration(name):
    """A start one unit in the last place away leads to the same answer."""
    run = scenario(name)
    truth = float64_truth(run)
    assert (truth.valid_until, truth.reason) == (run.times[-1], "")


@pytest.mark.parametrize(("name", "words"), REFUSED.items())
def test_a_scene_without_an_answer_is_refused_with_its_reason(name, words):
    """Resting contacts, disks that touch and close in, pushes in the body frame."""
    with pytest.raises(NoTruth, match=words):
        float64_truth(scenario(name))


@pytest.mark.parametrize("name", ["gas_of_100", "asteroids", "falling_box"])
def test_the_horizon_of_a_chaotic_scene_is_told(name):
    """It lies within the duration, and no sample beyond it is given; more samples do not change it."""
    run = scenario(name)
    truth = float64_truth(run)
    assert 0 < truth.valid_until < run.duration
    assert "float64 cannot tell" in truth.reason
    assert truth(run.times).t[-1] <= truth.valid_until
    assert truth(run.times).error_bound == 1e-9


# A second algorithm: all contacts as polynomials, all roots by numpy, nothing kept from one event to the next.


def first_fall(gap):
    """First t >= 0 at which a polynomial (highest power first) comes down through 0."""
    gap = np.trim_zeros(gap, "f")
    roots = np.roots(gap) if len(gap) > 1 else np.zeros(0)
    times = roots[np.abs(roots.imag) < 1e-12].real
    falling = np.polyval(np.polyder(gap), times) < 0
    return min(times[(times > -1e-12) & falling], default=np.inf)


def contacts(scene, x, v, a, images):
    """All contacts ahead: (time, disk, other or -1 - wall, normal to it at the contact)."""
    for i in range(scene.n):
        points = [(scene.radius[i], -1 - w, end, 0, 0) for w, wall in enumerate(scene.walls) for end in wall]
        others = [
            (scene.radius[i] + scene.radius[j], j, x[j] + shift, v[j], a[j])
            for j in range(i + 1, scene.n) for shift in images
        ]  # fmt: skip
        for reach, j, place, speed, pull in [*points, *others]:
            path = np.array([(a[i] - pull) / 2, v[i] - speed, x[i] - place])
            gap = sum(np.convolve(path[:, axis], path[:, axis]) for axis in range(2)) - [0, 0, 0, 0, reach**2]
            if (t := first_fall(gap)) < np.inf:
                yield t, i, j, np.array([np.polyval(path[:, axis], t) for axis in range(2)])
        for w, (start, end) in enumerate(scene.walls):
            along = (end - start) / np.hypot(*(end - start))
            for normal in (np.array([-along[1], along[0]]), np.array([along[1], -along[0]])):
                t = first_fall([a[i] @ normal / 2, v[i] @ normal, (x[i] - start) @ normal - scene.radius[i]])
                if t < np.inf and 0 < (x[i] + v[i] * t + a[i] * t * t / 2 - start) @ along < np.hypot(*(end - start)):
                    yield t, i, -1 - w, normal


def brute_force(scene, side, count):
    """Up to `count` hits as (t, i, j) within 5 s, and when it stopped and where; side: of the torus, or 0."""
    x, v, w = scene.position.copy(), scene.velocity.copy(), 1 / scene.mass
    a = np.where(scene.static[:, None], 0.0, scene.gravity)
    images = [np.array([k, m]) * side for k in (-1, 0, 1) for m in (-1, 0, 1)] if side else [np.zeros(2)]
    now, hits = 0.0, []
    while len(hits) < count:
        if side:
            x = np.mod(x, side)
        t, i, j, normal = min(contacts(scene, x, v, a, images), key=lambda c: c[0], default=(np.inf, 0, 0, None))
        t = min(t, 0.2 if side else 10.0)  # in 0.2 s nobody passes the next image
        if now + t > 5:
            break
        x, v, now = x + v * t + a * t * t / 2, v + a * t, now + t
        if t in (0.2, 10.0):
            continue
        normal = normal / np.hypot(*normal)
        speed, weight = (v[i] - v[j], w[i] + w[j]) if j >= 0 else (v[i], w[i])
        kick = (1 + scene.restitution) * (speed @ normal) / weight * normal
        v[i] -= w[i] * kick
        if j >= 0:
            v[j] += w[j] * kick
        hits.append((now, i, j))
    return hits, now, x


def random_scene(seed):
    """A box, a torus, or an open place with loose walls; any radii and masses, some static, gravity or none."""
    draw = np.random.default_rng(seed)
    n, kind = int(draw.integers(2, 7)), ("box", "torus", "open")[seed % 3]
    radius = draw.uniform(0.05, 0.3, n)
    walls = {"box": box([-1.6, -1.3], [1.7, 1.5]), "torus": np.zeros((0, 2, 2))}.get(kind)
    if walls is None:
        walls = draw.uniform(-1, 1, (2, 2, 2)) + [[[0, -2.4]], [[0, 2.4]]]
    position = scatter(draw, [0.01, 0.01], [1.79, 1.79], radius) if kind == "torus" else scatter(
        draw, [-1.2, -0.9], [1.3, 1.1], radius
    )  # fmt: skip
    mass = np.where(draw.random(n) < 0.2, np.inf, draw.uniform(0.3, 5, n))
    return Scene(
        position=position, velocity=np.where(np.isinf(mass)[:, None], 0.0, draw.normal(size=(n, 2))),
        radius=radius, mass=mass, walls=walls, restitution=float(draw.choice([0.6, 0.9, 1.0])),
        gravity=draw.normal(size=2) * (draw.random() < 0.6),
    ), 1.8 if kind == "torus" else 0.0  # fmt: skip


def hits_of(engine):
    """(t, i, j) of all hits, the lower disk first."""
    return [(t, *((i, j) if j < 0 or i < j else (j, i))) for t, i, j in engine.hits[:, :3].tolist()]


def compare(seed):
    """A random scene by the engine and by brute force: the first eight hits, and the positions after them."""
    scene, side = random_scene(seed)
    try:
        engine = EventEngine(scene, [[0, 0], [side, side]] if side else None)
    except NoTruth:  # a disk lies across the edge of the torus, or on a wall, and on another disk
        return
    hits, now, x = brute_force(scene, side, 8)
    engine.advance(now + 1e-9)
    found = hits_of(engine)[: len(hits)]
    # Eight hits of disks a tenth as large as their paths: each may take a digit from the sixteen there are.
    np.testing.assert_allclose(np.array(found).reshape(-1, 3), np.array(hits).reshape(-1, 3), rtol=0, atol=1e-7)
    apart = engine.look(now)[0] - x
    apart -= side * np.round(apart / side) if side else 0
    assert np.abs(apart).max() < 1e-7


def compare_all(seeds):
    """Compare one random scene after the other."""
    for seed in seeds:
        compare(seed)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_a_brute_force_algorithm_finds_the_same_hits(seed):
    """All pairs, all images, all walls and their ends; all roots at once."""
    compare(seed)


FILES = ("contact_times", "event_queue", "event_kernels", "event_impacts", "event_loop")
BUGS = {
    "stale record kept": ("d.tag[d.tag[i, PARTNER], COUNT] == d.tag[i, PARTNER_COUNT]", "True"),
    "nearest image": ("dx + shift_x, dy + shift_y", "dx - g.span[0] * round(dx / g.span[0]), dy"),
    "contact found late": ("return gap / (sqrt(disc) - closing) if", "return (sqrt(disc) - closing) / speed2 if"),
    "wall end forgotten": ("for part in range(3)", "for part in range(1)"),
    "static disk falls along": ("if rules.mixed and (ax", "if False and (ax"),
    "new cells not searched": ("d.tag[i, OWN_CODE]\n", "d.tag[i, OWN_CODE]\n            x1 = -2\n"),
}


def plain_kernels(right="", wrong=""):
    """The kernels as plain Python, one line of them replaced."""
    folder = Path(events.__file__).parent
    source = "\n".join((folder / f"{name}.py").read_text() for name in FILES)
    ours = r"from scenarios\.(event|contact|compiled)\w* import (\([^)]*\)|.*)"
    source = re.sub(rf"from __future__.*|@kernel|@inlined|{ours}", "", source)
    assert right in source
    names: dict = {"__name__": "plain"}
    exec(source.replace(right, wrong) if right else source, names)
    return SimpleNamespace(**names)


def test_the_kernels_as_plain_python_find_the_same(monkeypatch):
    """So what the next test catches is the bug, and not the way it was planted."""
    monkeypatch.setattr(events, "event_loop", plain_kernels())
    compare_all(range(12))


@pytest.mark.parametrize("bug", BUGS)
def test_a_planted_bug_is_caught_by_brute_force(bug, monkeypatch):
    """Each by a wrong list of hits in one of forty scenes."""
    monkeypatch.setattr(events, "event_loop", plain_kernels(*BUGS[bug]))
    with pytest.raises((AssertionError, NoTruth)):
        compare_all(range(40))


def state_after(scene, until, torus=None, cell=0.0):
    """The engine, and position and velocity at `until` s."""
    engine = EventEngine(scene, torus, cell)
    engine.advance(until)
    return engine, *engine.look(until)


def changed(scene, order=slice(None), x=lambda a: a, v=lambda a: a):
    """The scene with its disks in another order and its vectors mapped."""
    return replace(
        scene, position=x(scene.position)[order], velocity=v(scene.velocity)[order], radius=scene.radius[order],
        mass=scene.mass[order], angle=scene.angle[order], angular_velocity=scene.angular_velocity[order],
        inertia=scene.inertia[order], walls=x(scene.walls), gravity=v(scene.gravity),
        wrap=None if scene.wrap is None else np.sort(x(scene.wrap), axis=0),
    )  # fmt: skip


@pytest.mark.parametrize(("name", "until"), [("gas_of_100", 0.6), ("asteroids", 6.0), ("falling_box", 0.25)])
def test_order_and_mirror_do_not_matter(name, until):
    """The same gas with its disks shuffled, and seen in a mirror."""
    scene = scenario(name).scene
    _, x, v = state_after(scene, until)
    order = np.random.default_rng(3).permutation(scene.n)
    _, other, _ = state_after(changed(scene, order), until)
    # Rounding grows by the horizon's chaos: 1e-9 at the horizon, which lies a third beyond `until`.
    np.testing.assert_allclose(other, x[order], rtol=0, atol=1e-9)
    flip = np.array([-1.0, 1.0])
    _, other, speed = state_after(changed(scene, x=lambda a: a * flip, v=lambda a: a * flip), until)
    np.testing.assert_allclose(other * flip, x, rtol=0, atol=1e-9)
    np.testing.assert_allclose(speed * flip, v, rtol=0, atol=1e-7)


def test_time_runs_back_at_restitution_one():
    """Half a second, 160 hits, and half a second back."""
    scene = scenario("gas_of_100").scene
    engine, x, v = state_after(scene, 0.45)
    _, back, speed = state_after(replace(scene, position=x, velocity=-v), 0.45)
    assert len(engine.hits) > 100
    np.testing.assert_allclose(back, scene.position, rtol=0, atol=1e-8)
    np.testing.assert_allclose(-speed, scene.velocity, rtol=0, atol=1e-7)


@pytest.mark.parametrize("name", ["gas_of_100", "asteroids", "falling_box"])
def test_coarse_and_fine_cells_find_the_same_hits(name):
    """From cells of one diameter to three by three."""
    scene = scenario(name).scene
    until = 0.7 * float64_truth(scenario(name)).valid_until
    lists = [[hit[1:] for hit in hits_of(state_after(scene, until, cell=cell)[0])] for cell in (0.0, 0.37, 9.0)]
    assert lists[0] == lists[1] == lists[2]


def test_coarse_and_fine_cells_agree_on_a_torus():
    """As above, where three cells make the next image a neighbour on both sides."""
    scene, torus = gas(64, 0.3)
    lists = [[hit[1:] for hit in hits_of(state_after(scene, 4.0, torus, cell)[0])] for cell in (0.0, 1.9, 99.0)]
    assert len(lists[0]) > 200
    assert lists[0] == lists[1] == lists[2]


@pytest.mark.parametrize("packing", [0.1, 0.5])
def test_no_two_disks_ever_overlap(packing):
    """All pairs, all images, at a thousand times; and positions stay on the torus."""
    scene, torus = gas(60, packing)
    engine, side = EventEngine(scene, torus), torus[1, 0]
    i, j = np.triu_indices(60, 1)
    for at in np.linspace(0, 300, 1001)[1:]:
        engine.advance(at)
        x, _ = engine.look(at)
        apart = x[i] - x[j]
        apart -= side * np.round(apart / side)
        # A position is rounded at 20 m, and a time at 300 s moves it by 5e-14 m/s s: 1e-13.
        assert np.hypot(*apart.T).min() > 1 - 1e-12
        assert (np.abs(x / side - 0.5) < 0.5 + 1e-12).all()


def measured(n, packing, per_disk, seed=0):
    """Compressibility and hits per disk and time from the virial, after 200 hits a disk; and the two states."""
    scene, torus = gas(n, packing, seed)
    engine = EventEngine(scene, torus)
    at = 0.0
    while len(engine.hits) < 100 * n:
        at += 1.0
        engine.advance(at)
    before, (_, start) = len(engine.hits), engine.look(at)
    span = (per_disk - 200) * n / 2 / (before / at)
    engine.advance(at + span)
    hits, (_, end) = engine.hits[before:], engine.look(at + span)
    kinetic = (start**2).sum() / 2 / (n - 1)
    return 1 + hits[:, 3].sum() / (2 * n * kinetic * span), 2 * len(hits) / n / span, start, end


def check_gas(n, packing, per_disk, tolerance):
    """Z and the rate of hits against the virial series, energy and momentum against rounding."""
    z, rate, start, end = measured(n, packing, per_disk)
    expected = compressibility(packing)
    assert abs(z - expected) < (expected - 1) * (tolerance + 1 / n)
    # Enskog: Gamma = 4 / sqrt(pi) (Z - 1) sqrt(kT / m) / sigma.
    assert abs(rate / (4 / np.sqrt(np.pi) * (expected - 1)) - 1) < tolerance + 1 / n
    assert abs((end**2).sum() / (start**2).sum() - 1) < 1e-12
    assert np.abs(end.sum(axis=0)).max() < 1e-12 * np.abs(end).sum()
    return end


def test_a_gas_has_the_pressure_energy_and_momentum_of_the_literature():
    """A million hits of 1024 disks at packing 0.3; 0.6 % is three times the statistical error."""
    check_gas(1024, 0.3, 2150, 0.006)


@pytest.mark.slow
@pytest.mark.parametrize("packing", [0.1, 0.2, 0.3, 0.4, 0.5])
def test_gases_have_the_pressure_of_the_virial_series(packing):
    """Ten million hits each: a third of the statistical error of a million, and Maxwell's fourth moment."""
    end = check_gas(1024, packing, 19700, 0.002)
    v2 = (end**2).sum(axis=1)
    # <v4> / <v2>2 = 2 N / (N + 1); 1024 draws of an exponential: standard deviation 2 sqrt(5 / N).
    assert abs((v2**2).mean() / v2.mean() ** 2 - 2) < 4 * 2 * np.sqrt(5 / 1024)


def two(gap=0.5, closing=1.0, **fields):
    """Two disks of radius 0.5 on the x axis."""
    arrays = {
        "position": [[0.0, 0.0], [1.0 + gap, 0.0]], "velocity": [[closing, 0.0], [0.0, 0.0]],
        "radius": [0.5, 0.5], "mass": [1.0, 1.0], "restitution": 1.0,
    }  # fmt: skip
    return Scene(**(arrays | fields))


@pytest.mark.parametrize(
    ("scene", "torus", "words"),
    [
        (two(gap=-0.25), None, r"disks 0 and 1 overlap by 0\.25 m at the start: move one 0\.25 m away"),
        (two(gap=-(2.0**-52)), None, "disks 0 and 1 overlap by 2.22e-16 m"),
        (two(gap=0.0), None, "disks 0 and 1 touch and close in at 1 m/s at the start: leave a gap"),
        (two(walls=[[[0, -0.25], [9, -0.25]]]), None, r"disk 0 overlaps wall 0 by 0\.25 m at the start: move it 0\.25"),
        (two(walls=[[[-0.5, -9], [-0.5, 9]]], closing=-1.0), None, "disk 0 touches wall 0 and closes in at the start"),
        (two(wrap=[[0, -0.4], [9, 0.4]]), None, r"the box is 0\.8 m wide: its largest disk has a diameter of 1 m"),
        (two(), [[0, 0], [9, 2.9]], r"the torus is 2\.9 m wide: three diameters of its largest disk are 3 m"),
        (two(gap=7.5), [[0, 0], [9, 9]], r"disks 0 and 1 overlap by 0\.5 m"),
    ],
)  # fmt: skip
def test_a_start_that_is_none_is_refused_and_says_what_would_cure_it(scene, torus, words):
    """Judged in rationals: one unit in the last place is an overlap."""
    with pytest.raises(NoTruth, match=words):
        EventEngine(scene, torus)


def test_touching_disks_that_part_are_allowed():
    """And never hit."""
    engine, x, _ = state_after(two(gap=0.0, closing=-1.0), 1.0)
    assert len(engine.hits) == 0
    assert x.tolist() == [[-1.0, 0.0], [1.0, 0.0]]


def test_accumulation_is_refused_with_time_and_disk():
    """A ball at e = 0.5: from 1.4 m, over after 3 t1; the answer up to there is given."""
    fall = Scene(
        position=[[0, 1.5]], velocity=[[0, 0]], radius=[0.1], mass=[1.0], restitution=0.5, gravity=[0, -9.81],
        walls=[[[-1, 0], [1, 0]]],
    )  # fmt: skip
    end = 3 * np.sqrt(2 * 1.4 / 9.81)
    truth = float64_truth(Scenario("ball", "", "", fall, 3.0, 0.01))
    assert truth.valid_until == pytest.approx(end, abs=1e-12)
    assert re.search(r"64 hits of disk 0, the last with wall 0, come at once at 1\.6027", truth.reason)
    assert truth(np.linspace(0, 3, 301)).t[-1] == 1.6


def test_the_wrap_is_an_event_and_a_reentry_on_top_of_a_disk_ends_the_answer():
    """It leaves at 0.5 s to the right; one that waits on the left edge is in its way, another lets it pass."""
    box_ = [[-5, -3], [5, 3]]
    for wait, free in ((-4.2, False), (-3.5, True)):
        scene = Scene(
            position=[[4.0, 0.0], [wait, 0.0]], velocity=[[2.0, 0.0], [0.0, 0.0]], radius=[0.5, 0.5], mass=[1.0, 1.0],
            restitution=1.0, wrap=box_,
        )  # fmt: skip
        if free:
            engine, x, v = state_after(scene, 1.0)
            assert hits_of(engine) == [(0.75, 0, 1)]
            assert x.tolist() == [[-4.5, 0.0], [-3.0, 0.0]]
            assert v.tolist() == [[0.0, 0.0], [2.0, 0.0]]
        else:
            with pytest.raises(NoTruth, match=r"disk 0 re-enters on top of disk 1 at 0\.5 s"):
                state_after(scene, 1.0)


def test_a_pushed_disk_hits_a_resting_one_at_the_root_of_the_gap():
    """From rest under 2 m/s2: a gap of 1 m is closed after 1 s at 2 m/s; equal masses swap."""
    scene = two(gap=1.0, closing=0.0, restitution=1.0)
    run = Scenario("pushed", "", "", scene, 4.0, 0.125, thrusts=[Thrust(0, 0.5, 1.5, [2.0, 0.0])])
    truth = float64_truth(run)(run.times)
    assert truth.collisions.t.tolist() == pytest.approx([1.5], abs=1e-15)
    assert truth.velocity[-1, 1, 0] == pytest.approx(2.0, abs=1e-14)
    assert truth.position[-1, 1, 0] == pytest.approx(2.0 + 2.0 * 2.5, abs=1e-14)


def test_the_log_and_the_epochs_change_nothing():
    """Hits are told in full over many epochs of the clock, whatever the stops on the way."""
    scene, torus = gas(16, 0.05)
    at_once, x, _ = state_after(scene, 5.0, torus)
    often = EventEngine(scene, torus)
    for at in np.linspace(0, 5, 777):
        often.advance(at)
    assert (often.hits == at_once.hits).all()
    assert (often.look(5.0)[0] == x).all()
    long, _, end = state_after(scene, 20000.0, torus)
    assert len(long.hits) > 2 * events.LOG_ROWS
    assert (np.diff(long.hits[:, 0]) >= 0).all()
    assert (end**2).sum() == pytest.approx((scene.velocity**2).sum(), rel=1e-12)

"""Disks with friction: bounces that change the spin, sliding that becomes rolling, slopes,
collisions of spinning disks."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.families.placing import box, lay_out, scatter, tag
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import Collision, answer
from crosscheck2d.scenarios.truth.exact import with_oracle
from crosscheck2d.scenarios.truth.sliding import between_plates, bounce, slide, spinning_pair

G = 9.81
FLOOR = [[[-10, 0], [10, 0]]]
IMPACT = (
    "J_t = min(mu J_n, |slip| / (1/m_a + 1/m_b + r_a2/I_a + r_b2/I_b)) (Foerster, Louge, Chang &"
    " Allia, Phys. Fluids 6, 1108, 1994)"
)
ROLL = "sliding at mu g, then rolling (any textbook of mechanics)"


def friction_bounce(restitution: float, friction: float) -> Scenario:
    """Some of six disks slip during the whole collision, some stick, one is at the limit."""
    e, mu, radius, fall = restitution, friction, 0.25, 4.0
    # At the limit friction just ends the slip of the rim, which is 3 mu (1 + e) v_n for a solid
    # disk.
    edge = 3 * mu * (1 + e) * fall
    return bounce_on_floor(
        f"friction_bounce_{tag('e', e)}_{tag('mu', mu)}",
        f"Does a bounce at e = {e:g} and friction {mu:g} turn and brake disks, slipping and"
        " sticking, as Coulomb's law says?",
        along=np.array([0.0, 1.0, edge / 2, 5.0, 5.0, 6.0]),
        spin=np.array([24.0, 0.0, edge / 2 / radius, 0.0, -20.0, -(6 + 1.5 * edge) / radius]),
        fall=fall,
        restitution=e,
        friction=mu,
    )


def bounce_on_floor(
    name: str,
    asks: str,
    along: Array,
    spin: Array,
    fall: float,
    restitution: float,
    friction: float,
    radius: float = 0.25,
    apart: float = 1.5,
) -> Scenario:
    """Solid disks of 1 kg, `apart` m from centre to centre, each thrown from 0.83 m above the floor
    with a speed along it, one downwards, m/s, and a spin, rad/s; half a second without gravity."""
    height, n = 0.83, len(along)
    scene = lay_out(
        np.stack([apart * np.arange(n) - 5, np.full(n, radius + height)], axis=-1),
        np.stack([along, np.full(n, -fall)], axis=-1),
        radius,
        restitution=restitution,
        friction=friction,
        angular_velocity=spin,
        walls=[[[-10, 0], [12, 0]]],
    )

    def truth(t: Array) -> Trajectory:
        start, v = start_of(scene)
        two = np.full(n, 2.0)
        legs = bounce(start, v, scene.radius, two, restitution, friction, height)
        collisions = [(float(legs.start[1]), i, -1, (1 + restitution) * fall) for i in range(n)]
        return turning_answer(scene, t, legs.at(t), collisions)

    return Scenario(name, asks, IMPACT, scene, duration=0.5, truth=truth)


def spinning_disks_meet() -> Scenario:
    """Three pairs: slow spins that stick, fast ones that slip, and unequal disks off centre."""
    scene = lay_out(
        [[-1.26, -3], [1.3, -3], [-1.23, 0], [1.3, 0], [-1.2, 3], [1.3, 3.2]],
        [[1.1, 0], [-0.9, 0], [1.1, 0], [-0.9, 0], [1.2, 0.1], [-0.7, 0.05]],
        radius=[0.25, 0.25, 0.25, 0.25, 0.3, 0.2],
        mass=[1.0, 1.0, 1.0, 1.0, 2.0, 0.5],
        angular_velocity=[4.0, 4.0, 20.0, 25.0, -12.0, 3.0],
        restitution=0.8,
        friction=0.2,
    )

    def truth(t: Array) -> Trajectory:
        motions, collisions = [], list[Collision]()
        for i in range(0, scene.n, 2):
            legs, impulse = spinning_pair(scene, i)
            motions.append(legs.at(t))
            collisions.append((float(legs.start[1]), i, i + 1, float(impulse[0])))
        place, rate = (np.concatenate(part, axis=1) for part in zip(*motions))
        return turning_answer(scene, t, (place, rate), collisions)

    return Scenario(
        "spinning_disks_meet",
        "Do two spinning disks exchange spin and speed in a collision, slipping or sticking?",
        IMPACT,
        scene,
        duration=3.0,
        truth=truth,
    )


def spin_to_flight_and_back() -> Scenario:
    radius, gap = 0.25, 1.5
    scene = lay_out(
        [[0.0, radius + gap / 2]],
        [0.0, -2.17],
        friction=1.0,
        angular_velocity=[40.0],
        walls=[[[-10, 0], [10, 0]], [[-10, 2 * radius + gap], [10, 2 * radius + gap]]],
    )

    def truth(t: Array) -> Trajectory:
        start, v = (part[0] for part in start_of(scene))
        legs = between_plates(start, v, radius, 2.0, gap, scene.friction, t[-1])
        place, rate = legs.at(t)
        kick = 2 * abs(v[1])
        collisions = [(float(at), 0, -1 - k % 2, kick) for k, at in enumerate(legs.start[1:])]
        return turning_answer(scene, t, (place[:, None], rate[:, None]), collisions)

    return Scenario(
        "spin_to_flight_and_back",
        "Does the spin of a disk become flight at the floor, and spin again at the ceiling?",
        IMPACT,
        scene,
        duration=4.0,
        truth=truth,
    )


def slide_on_floor(
    name: str, asks: str, speed: float, spin: float, duration: float, friction: float = 0.2
) -> Scenario:
    """A solid disk of 1 kg that touches the floor, with a speed along it, m/s, and a spin,
    rad/s."""
    radius = 0.25
    scene = lay_out(
        [[-2.0, radius]],
        [speed, 0.0],
        restitution=0.0,
        friction=friction,
        angular_velocity=[spin],
        walls=FLOOR,
        gravity=[0.0, -G],
    )

    def truth(t: Array) -> Trajectory:
        way, rate = slide(speed, spin, radius, 2.0, friction, 0.0, G).at(t)
        place, moves = (np.zeros((len(t), 1, 3)) for _ in range(2))
        place[:, 0, 0::2], moves[:, 0, 0::2] = way, rate
        place[..., :2] += scene.position
        return turning_answer(scene, t, (place, moves), [(0.0, 0, -1, 0.0)])

    return Scenario(name, asks, ROLL, scene, duration, truth=truth)


# Right triangles in whole numbers a, b, c: the slope is a / b, and with these scales a disk of
# radius c * scale touches its incline exactly in float64.
SLOPES = (
    (5, 12, 13, 1 / 32),
    (8, 15, 17, 1 / 64),
    (3, 4, 5, 1 / 16),
    (20, 21, 29, 1 / 64),
    (24, 7, 25, 1 / 64),
)


def roll_or_slide() -> Scenario:
    """On slopes of 5/12 to 24/7: with friction 1/4 they roll up to 3/4, and slide from there on."""
    friction, spacing = 0.25, 7.0
    sides = np.array([row[:3] for row in SLOPES], float)
    radius = np.array([c * scale for _, _, c, scale in SLOPES])
    foot = spacing * (np.arange(len(SLOPES)) - 2.0)
    normal = sides[:, :2] / sides[:, 2:]
    # Positions along each incline are binary fractions, 3 to 4 m in either direction.
    reach = np.array([[b, -a] for a, b, _, _ in SLOPES]) * 2.0 ** -np.round(
        np.log2(sides[:, 2:] / 4)
    )
    scene = lay_out(
        np.stack([foot, 0 * foot], axis=-1)
        + np.array([[a * scale, b * scale] for a, b, _, scale in SLOPES]),
        radius=radius,
        walls=np.stack([[foot, 0 * foot] - reach.T, [foot, 0 * foot] + reach.T]).transpose(2, 0, 1),
        gravity=[0.0, -G],
        restitution=0.0,
        friction=friction,
    )
    down = np.stack([normal[:, 1], -normal[:, 0]], axis=-1)

    def truth(t: Array) -> Trajectory:
        place, moves = (np.zeros((len(t), scene.n, 3)) for _ in range(2))
        for i, (sine, cosine) in enumerate(normal):
            way, rate = slide(0.0, 0.0, radius[i], 2.0, friction, G * sine, G * cosine).at(t)
            place[:, i], moves[:, i] = (
                np.column_stack([np.outer(part[:, 0], down[i]), part[:, 1]]) for part in (way, rate)
            )
        place[..., :2] += scene.position
        collisions = [(0.0, i, -1 - i, 0.0) for i in range(scene.n)]
        return turning_answer(scene, t, (place, moves), collisions)

    return Scenario(
        "roll_or_slide",
        "Does a disk on a slope roll up to tan(angle) = 3 mu, and slide on a steeper one?",
        "rolling needs tan(angle) <= mu (1 + m r2 / I); a = g sin / (1 + I / (m r2)), else g (sin -"
        " mu cos)",
        scene,
        duration=0.75,
        truth=truth,
    )


def frictional_box(seed: int = 0) -> Scenario:
    rng = np.random.default_rng(seed)
    radius = rng.uniform(0.15, 0.35, 12)
    scene = lay_out(
        scatter(rng, [-1.6, -1.6], [1.6, 1.6], radius),
        rng.normal(0, 1.5, (12, 2)),
        radius,
        4 * radius**2,
        restitution=0.9,
        friction=0.3,
        angular_velocity=rng.normal(0, 10, 12),
        walls=box([-2, -2], [2, 2]),
    )
    question = Scenario(
        "frictional_box",
        "Do disks in a box with friction lose energy, and never gain any?",
        "in many digits up to its horizon; later only what is conserved, and the loss",
        scene,
        duration=4.0,
        seed=seed,
    )
    return with_oracle(question)


def start_of(scene: Scene) -> tuple[Array, Array]:
    """Position and angle, velocity and spin at t = 0, (n, 3) each."""
    return (
        np.column_stack([scene.position, scene.angle]),
        np.column_stack([scene.velocity, scene.angular_velocity]),
    )


def turning_answer(
    scene: Scene, t: Array, motion: tuple[Array, Array], collisions: list[Collision]
) -> Trajectory:
    """The `Trajectory` of a motion (k, n, 3) of x, y and angle, and its rate."""
    place, rate = motion
    turning = place[..., 2], rate[..., 2]
    return answer(scene, t, (place[..., :2], rate[..., :2]), collisions, turning)


FRICTION = (
    *(friction_bounce(e, mu) for mu in (0.1, 0.5) for e in (0.0, 0.5, 1.0)),
    spinning_disks_meet(),
    spin_to_flight_and_back(),
    slide_on_floor(
        "slip_to_roll",
        "Does a disk that slides begin to roll at 2/3 of its speed, after v / (3 mu g)?",
        speed=3.0,
        spin=0.0,
        duration=1.5,
    ),
    slide_on_floor(
        "backspin_returns",
        "Does a disk with back spin stop, come back and roll at the right time?",
        speed=1.5,
        spin=30.0,
        duration=3.0,
    ),
    roll_or_slide(),
    frictional_box(),
)

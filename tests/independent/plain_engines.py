"""pymunk, Box2D 2.3 and Box2D 3.1, called directly, as their manuals say; no adapter is asked how.

Each function plays a scenario in steps of `dt` and returns position (k, n, 2), velocity (k, n, 2),
angle (k, n) and angular velocity (k, n) at the scenario's samples, SI. `asked` holds the settings
that are not the engine's default, by the names and with the numbers under which the project records
them; nothing else is taken from it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import atan2, cos, pi, sin
from typing import Any

import Box2D
import numpy as np
import pyb2d3
import pymunk

from crosscheck2d.scenarios.model import Scenario, Scene

Samples = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
Row = tuple[float, ...]  # x, y, vx, vy, angle, angular velocity of one disk


Force = tuple[int, np.ndarray, float]


def forces(
    scenario: Scenario, step: int, dt: float, angle: Callable[[int], float]
) -> Iterator[Force]:
    """Disk, force (2,) N and torque N m of every thrust in a step: its mean over that, so that the
    impulse is exact.

    A force in the axes of the disk is turned by the angle which that has at the start of the step.
    """
    for thrust in scenario.thrusts:
        share = min(thrust.stop / dt, step + 1) - max(thrust.start / dt, step)
        if share > 1e-9:
            x, y = thrust.force
            if thrust.frame == "body":
                c, s = cos(angle(thrust.disk)), sin(angle(thrust.disk))
                x, y = c * x - s * y, s * x + c * y
            yield thrust.disk, np.array([x, y]) * share, thrust.torque * share


def across(scene: Scene, x: float, y: float) -> tuple[float, float] | None:
    """Where a centre that has left the box goes on from the opposite edge; None if it is inside."""
    if scene.wrap is None:
        return None
    (left, bottom), (right, top) = scene.wrap
    width, height = right - left, top - bottom
    there = (
        (x + width if x < left else x - width if x > right else x),
        (y + height if y < bottom else y - height if y > top else y),
    )
    return None if there == (x, y) else there


def sampled(
    scenario: Scenario, dt: float, step: Callable[[int], None], read: Callable[[], list[Row]]
) -> Samples:
    rows = [read()]
    substeps = round(scenario.sample_interval / dt)
    for k in range(scenario.intervals):
        for number in range(k * substeps, (k + 1) * substeps):
            step(number)
        rows.append(read())
    all_ = np.array(rows)
    return all_[..., :2], all_[..., 2:4], all_[..., 4], all_[..., 5]


def play_pymunk(scenario: Scenario, dt: float, asked: dict[str, Any]) -> Samples:
    scene, space = scenario.scene, pymunk.Space()
    space.gravity = tuple(scene.gravity.tolist())
    biases = ("collision_slop", "collision_bias", "collision_persistence")
    for name in ("iterations", "damping", *biases):
        if name in asked:
            setattr(space, name, asked[name])
    elasticity, friction, bodies = asked["elasticity"], asked["friction"], []
    for i in range(scene.n):
        if scene.static[i]:
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
        else:
            body = pymunk.Body(float(scene.mass[i]), float(scene.inertia[i]))
            body.velocity = tuple(scene.velocity[i].tolist())
            body.angular_velocity = float(scene.angular_velocity[i])
        body.position, body.angle = tuple(scene.position[i].tolist()), float(scene.angle[i])
        if scene.static[i]:  # a shape beside the origin of the static body; `body` is only read
            disk = pymunk.Circle(
                space.static_body, float(scene.radius[i]), tuple(scene.position[i].tolist())
            )
        else:
            disk = pymunk.Circle(body, float(scene.radius[i]))
            space.add(body)
        disk.elasticity, disk.friction = elasticity, friction
        space.add(disk)
        bodies.append(body)
    for start, end in scene.walls.tolist():
        wall = pymunk.Segment(space.static_body, start, end, 0)
        wall.elasticity, wall.friction = elasticity, friction
        space.add(wall)

    def step(number: int) -> None:
        for i, force, torque in forces(scenario, number, dt, lambda i: bodies[i].angle):
            bodies[i].force = bodies[i].force + pymunk.Vec2d(*force.tolist())
            bodies[i].torque += torque
        space.step(dt)
        for body in bodies:
            if there := across(scene, *body.position):
                body.position = there

    def read() -> list[Row]:
        return [
            (*body.position, *body.velocity, body.angle, body.angular_velocity) for body in bodies
        ]

    return sampled(scenario, dt, step, read)


def play_box2d(scenario: Scenario, dt: float, asked: dict[str, Any]) -> Samples:
    """Box2D 2.3: the scene in units of `length` m and `time` s, a body a disk, all walls as
    edges."""
    scene = scenario.scene
    # Units a metre, s a unit, units a m/s.
    length = 1 / float(asked.get("unit of length in m", 1.0))
    time = float(asked.get("unit of time in s", 1.0))
    speed = length * time
    iterations = [int(word) for word in asked["velocity, position iterations"].split(",")]
    world = Box2D.b2World(gravity=tuple((scene.gravity * (length * time**2)).tolist()))
    sleeping = asked.get("sleeping", True)
    world.allowSleeping = sleeping
    world.continuousPhysics = asked.get("continuous collision", True)
    world.subStepping = asked.get("sub-stepping", False)
    world.warmStarting = asked.get("warm starting", True)
    surface: dict[str, Any] = {"restitution": float(asked["restitution"])}
    if "friction" in asked:
        surface["friction"] = asked["friction"]
    bodies = []
    for i in range(scene.n):
        circle = Box2D.b2FixtureDef(
            shape=Box2D.b2CircleShape(radius=float(scene.radius[i] * length)), density=1, **surface
        )
        position = tuple((scene.position[i] * length).tolist())
        if scene.static[i]:
            body = world.CreateStaticBody(
                position=position, angle=float(scene.angle[i]), fixtures=circle
            )
        else:
            body = world.CreateDynamicBody(
                position=position,
                angle=float(scene.angle[i]),
                allowSleep=sleeping,
                fixtures=circle,
                linearVelocity=tuple((scene.velocity[i] * speed).tolist()),
                angularVelocity=float(scene.angular_velocity[i] * time),
                bullet=asked.get("continuous collision between disks", False),
            )
            body.massData = Box2D.b2MassData(
                mass=float(scene.mass[i]), center=(0, 0), I=float(scene.inertia[i] * length**2)
            )
        bodies.append(body)
    for start, end in (scene.walls * length).tolist():
        edge = Box2D.b2EdgeShape(vertices=[start, end])
        if "wall skin in m" in asked:
            edge.radius = asked["wall skin in m"] * length
        world.CreateStaticBody(fixtures=Box2D.b2FixtureDef(shape=edge, **surface))

    def step(number: int) -> None:
        for i, force, torque in forces(scenario, number, dt, lambda i: bodies[i].angle):
            bodies[i].ApplyForceToCenter(tuple((force * (length * time**2)).tolist()), True)
            bodies[i].ApplyTorque(torque * length**2 * time**2, True)
        world.Step(dt / time, *iterations)
        for body in bodies:
            if there := across(scene, body.position.x / length, body.position.y / length):
                body.transform = (there[0] * length, there[1] * length), body.angle

    def read() -> list[Row]:
        return [
            (
                b.position.x / length,
                b.position.y / length,
                b.linearVelocity.x / speed,
                b.linearVelocity.y / speed,
                b.angle,
                b.angularVelocity / time,
            )
            for b in bodies
        ]

    return sampled(scenario, dt, step, read)


def play_box2d_v3(scenario: Scenario, dt: float, asked: dict[str, Any]) -> Samples:
    scene, world_of = scenario.scene, {"gravity": tuple(scenario.scene.gravity.tolist())}
    if "restitution threshold in m/s" in asked:
        world_of["restitution_threshold"] = asked["restitution threshold in m/s"]
    if "speed cap in m/s" in asked:
        world_of["maximum_linear_speed"] = asked["speed cap in m/s"]
    # For the whole process, and before the world is made.
    pyb2d3.set_length_units_per_meter(float(asked.get("length unit in m", 1.0)))
    try:
        return played_box2d_v3(scene, scenario, dt, asked, pyb2d3.World(**world_of))
    finally:
        pyb2d3.set_length_units_per_meter(1.0)


def played_box2d_v3(
    scene: Scene, scenario: Scenario, dt: float, asked: dict[str, Any], world: Any
) -> Samples:
    sleeping = asked.get("sleeping", True)
    world.sleeping_enabled = sleeping
    world.continuous_enabled = asked.get("continuous collision", True)
    if tuning := asked.get("contact tuning (hertz, damping ratio, push speed in m/s)"):
        world.set_contact_tuning(*(float(word) for word in tuning.split(",")))
    surface = {"restitution": float(asked["restitution"])}
    if "friction" in asked:
        surface["friction"] = asked["friction"]
    definition = pyb2d3.shape_def(density=1, material=pyb2d3.surface_material(**surface))
    for start, end in scene.walls.tolist():
        world.create_static_body().create_segment_shape(
            definition, pyb2d3.segment(tuple(start), tuple(end))
        )
    bodies = []
    for i in range(scene.n):
        turn = pyb2d3.make_rot(0)
        turn.c, turn.s = cos(scene.angle[i]), sin(scene.angle[i])
        place = {"position": tuple(scene.position[i].tolist()), "rotation": turn}
        circle = pyb2d3.circle(radius=float(scene.radius[i]))
        if scene.static[i]:
            body = world.create_static_body(**place)
            body.create_circle_shape(definition, circle)
        else:
            body = world.create_dynamic_body(
                **place,
                linear_velocity=tuple(scene.velocity[i].tolist()),
                angular_velocity=float(scene.angular_velocity[i]),
                enable_sleep=sleeping,
                is_bullet=asked.get("continuous collision between disks", False),
            )
            body.create_circle_shape(definition, circle)
            mass = pyb2d3.MassData()
            mass.mass, mass.rotational_inertia = float(scene.mass[i]), float(scene.inertia[i])
            mass.center = (0, 0)
            body.mass_data = mass
        bodies.append(body)
    angles = scene.angle.copy()

    def follow() -> None:
        """An angle is read modulo a whole turn: the nearest to the one before is meant."""
        for i, body in enumerate(bodies):
            new = atan2(body.rotation.s, body.rotation.c)
            angles[i] = new + 2 * pi * round((angles[i] - new) / (2 * pi))

    follow()

    def step(number: int) -> None:
        for i, force, torque in forces(scenario, number, dt, lambda i: angles[i]):
            bodies[i].apply_force_to_center(tuple(force.tolist()))
            bodies[i].apply_torque(torque)
        world.step(dt, int(asked["substeps"]))
        for body in bodies:
            if there := across(scene, *body.position):
                body.set_transform(there, body.rotation)
        follow()

    def read() -> list[Row]:
        return [
            (*b.position, *b.linear_velocity, angles[i], b.angular_velocity)
            for i, b in enumerate(bodies)
        ]

    return sampled(scenario, dt, step, read)


PLAIN = {"pymunk": play_pymunk, "box2d": play_box2d, "box2d_v3": play_box2d_v3}


class Settings(dict[str, Any]):
    """Notes which of its keys are `read`: what an adapter asks for beside them would go unnoticed
    here."""

    def __init__(self, asked: dict[str, Any]) -> None:
        super().__init__(asked)
        self.read = set[str]()

    def __contains__(self, name: object) -> bool:
        self.read.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> Any:
        self.read.add(name)
        return super().__getitem__(name)

    def get(self, name: str, default: Any = None) -> Any:
        self.read.add(name)
        return super().get(name, default)

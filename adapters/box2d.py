"""box2d-py 2.3.8 (Box2D 2.3), float32: collide at the old position, then one velocity solve, then
position correction."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import Box2D
import numpy as np

from crosscheck2d.adapters.advance import onto_torus
from crosscheck2d.adapters.engine import KEPT, PASSED, ContactImpulse
from crosscheck2d.adapters.float32 import must_fit, must_not_be_cut, rounding, vector
from crosscheck2d.adapters.friction import of_shapes
from crosscheck2d.adapters.library_versions import BOX2D, version
from crosscheck2d.adapters.matched import read_searched
from crosscheck2d.scenarios.model import Array, Scene, State

SHIPPED: dict[str, Any] = {
    "velocity_iterations": 8,  # as the manual recommends; `Step` has no defaults
    "position_iterations": 3,
    "continuous": True,
    "bullet": False,
    "sub_stepping": False,
    "warm_starting": True,
    "skin": True,
}
MATCHED = read_searched("box2d").chosen


class Box2DEngine:
    """`shipped`: restitution, friction, mass and inertia are set, all else is the engine's default,
    including the friction of a scene that states none.

    `matched`: the scene in other units. Box2D treats collisions below 1 unit of length per unit of
    time as inelastic, and that 1 is compiled in; with a time unit of 1000 s it becomes 1 mm/s. The
    length unit is an eighth of the smallest radius, which shrinks slop and the tolerance of
    continuous collision; or twice the step displacement of the fastest disk if that is more,
    because Box2D cuts motion at 2 units per step; a scene that still reaches this cap is refused.
    Continuous collision, also between disks, puts collisions at their own time within a step. No
    sleep or wall skin. The values are those of matched.toml, by `crosscheck tune`.

    Changed one at a time by `options.py`, `table.py` and `crosscheck tune`: `sleeping` (None: the
    profile's), `turning` (False: no inertia, so no spin), `friction` (None: as above); `settings`
    are keys of `MATCHED`.
    """

    listening, wrapping = True, 0.0

    def __init__(
        self,
        profile: str,
        *,
        sleeping: bool | None = None,
        turning: bool = True,
        friction: float | None = None,
        **settings: Any,
    ) -> None:
        self.matched = profile == "matched"
        self.chosen = (MATCHED if self.matched else SHIPPED) | settings
        self.turning = turning
        self.sleeping = not self.matched if sleeping is None else sleeping
        self.asked_friction = friction

    def load(self, scene: Scene, dt: float) -> None:
        self.scene, self.dt, self.steps = scene, dt, 0
        self.friction = of_shapes(scene, self.matched, self.asked_friction)
        chosen = self.chosen
        # s per engine unit of time, engine units of length per m
        self.time, self.length = chosen.get("time_unit", 1.0), 1.0
        if "length_unit" in chosen:
            least = chosen["length_unit"] * scene.radius.min()
            step = chosen.get("step_unit", 0.0) * fastest(scene) * dt
            self.length = float(1.0 / max(least, step))
        self.speed = self.time * self.length
        must_fit(scene, self.length, self.time)
        self.speed_cap = Box2D.b2_maxTranslation / self.length / dt
        self.spin_cap = Box2D.b2_maxRotation / dt
        self.listener = Listener(self)
        gravity = scene.gravity * self.speed * self.time
        heard = {"contactListener": self.listener} if self.listening else {}
        self.world = Box2D.b2World(gravity=vector(gravity), **heard)
        self.continuous, self.bullet = chosen["continuous"], chosen["bullet"]
        self.world.continuousPhysics = self.continuous
        self.world.subStepping = chosen["sub_stepping"]
        # `doSleep` only sets a Python attribute that the engine never sees
        self.world.SetAllowSleeping(self.sleeping)
        self.world.warmStarting = chosen["warm_starting"]
        self.velocity_iterations = chosen["velocity_iterations"]
        self.position_iterations = chosen["position_iterations"]
        self.bodies = [self._disk(i) for i in range(scene.n)]
        self.walls = [self._wall(w) for w in range(len(scene.walls))]

    def _surface(self) -> dict[str, float]:
        friction = {} if self.friction is None else {"friction": self.friction}
        return {"restitution": float(self.scene.restitution), **friction}

    def _disk(self, i: int) -> Any:
        scene, length = self.scene, self.length
        shape = Box2D.b2CircleShape(radius=float(scene.radius[i]) * length)
        fixture = Box2D.b2FixtureDef(shape=shape, density=1.0, **self._surface())
        place = {
            "position": vector(scene.position[i] * length),
            "angle": float(scene.angle[i]),
            "userData": i,
        }
        if scene.static[i]:
            return self.world.CreateStaticBody(**place, fixtures=fixture)
        body = self.world.CreateDynamicBody(
            **place,
            linearVelocity=vector(scene.velocity[i] * self.speed),
            angularVelocity=float(scene.angular_velocity[i]) * self.time,
            allowSleep=self.sleeping,
            bullet=self.bullet,
        )
        body.CreateFixture(fixture)
        # After the fixture: adding one computes mass and inertia from its density.
        inertia = float(scene.inertia[i]) * length**2 if self.turning else 0.0
        body.massData = Box2D.b2MassData(mass=float(scene.mass[i]), center=(0, 0), I=inertia)
        return body

    def _wall(self, w: int) -> Any:
        start, end = (vector(point * self.length) for point in self.scene.walls[w])
        shape = Box2D.b2EdgeShape(vertices=[start, end])
        if not self.chosen["skin"]:
            shape.radius = 0.0
        body = self.world.CreateStaticBody(userData=-1 - w)
        body.CreateFixture(Box2D.b2FixtureDef(shape=shape, **self._surface()))
        return body

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        per_time2 = self.time**2
        self.bodies[disk].ApplyForceToCenter(vector(force * self.length * per_time2), True)
        self.bodies[disk].ApplyTorque(float(torque * self.length**2 * per_time2), True)

    def step(self, count: int = 1) -> None:
        dt = self.dt / self.time
        for _ in range(count):
            self.world.Step(dt, self.velocity_iterations, self.position_iterations)
            self.steps += 1
            if self.scene.wrap is not None:
                started = perf_counter()
                self._wrap()
                self.wrapping += perf_counter() - started

    def _wrap(self) -> None:
        assert self.scene.wrap is not None
        (x0, y0), (x1, y1) = (self.scene.wrap * self.length).tolist()
        for body in self.bodies:
            x, y = body.position
            if not (x0 <= x <= x1 and y0 <= y <= y1):
                body.transform = ((onto_torus(x, x0, x1), onto_torus(y, y0, y1)), body.angle)

    def read(self) -> State:
        # Attribute by attribute: box2d-py has no bulk read.
        n, bodies = self.scene.n, self.bodies
        position = np.array([tuple(b.position) for b in bodies], float).reshape(n, 2) / self.length
        velocity = np.array([tuple(b.linearVelocity) for b in bodies], float).reshape(n, 2)
        velocity /= self.speed
        angle = np.array([b.angle for b in bodies], float)
        angular_velocity = np.array([b.angularVelocity for b in bodies], float) / self.time
        if self.matched:
            speed = np.hypot(velocity[:, 0], velocity[:, 1])
            unit = f"{Box2D.b2_maxTranslation:g} of its length units of {1 / self.length:.3g} m"
            unit += " (b2_maxTranslation, compiled into 2.3)"
            must_not_be_cut("speed", speed, self.speed_cap, "m/s", unit)
            turn = "a quarter of a turn (b2_maxRotation, compiled into 2.3)"
            must_not_be_cut("spin", angular_velocity, self.spin_cap, "rad/s", turn)
        return State(position, velocity, angle, angular_velocity)

    def collisions(self) -> list[ContactImpulse]:
        return [
            ContactImpulse(step, i, j, impulse / self.speed)
            for step, i, j, impulse in self.listener.log
        ]

    def settings(self) -> dict[str, tuple[Any, Any]]:
        matched, world, chosen = self.matched, self.world, self.chosen
        fixture = self.bodies[0].fixtures[0]
        iterations = f"{self.velocity_iterations}, {self.position_iterations}"
        edge = self.walls[0].fixtures[0].shape.radius / self.length if self.walls else "no wall"
        return {
            "unit of time in s": (self.time if matched else None, KEPT),
            "unit of length in m": (1 / self.length if matched else None, KEPT),
            "restitution threshold in m/s": (None, Box2D.b2_velocityThreshold / self.speed),
            "linear slop in m": (None, Box2D.b2_linearSlop / self.length),
            "speed cap in m/s": (None, self.speed_cap),
            "spin cap in rad/s": (None, self.spin_cap),
            "wall skin in m": (None if chosen["skin"] else 0.0, edge),
            "friction": (self.friction, fixture.friction),
            "restitution": (self.scene.restitution, fixture.restitution),
            "sleeping": (self.sleeping if matched else None, world.GetAllowSleeping()),
            "continuous collision": (self.continuous if matched else None, world.continuousPhysics),
            "continuous collision between disks": (
                self.bullet if matched else None,
                any(body.bullet for body in self.bodies),
            ),
            "sub-stepping": (chosen["sub_stepping"] if matched else None, world.subStepping),
            "warm starting": (chosen["warm_starting"] if matched else None, world.warmStarting),
            "velocity, position iterations": (iterations, PASSED),
            "float32 rounding of the start in m": (None, rounding(self.scene)),
        }

    def versions(self) -> dict[str, str]:
        return {BOX2D: version(BOX2D)}

    def close(self) -> None:
        self.world = self.bodies = self.walls = self.listener = None  # type: ignore[assignment]


def fastest(scene: Scene) -> float:
    """m/s, upper bound: the fastest disk after a fall through the whole height of the scene."""
    points = np.concatenate([scene.position, scene.walls.reshape(-1, 2)])
    fall = np.ptp(points @ scene.gravity)
    return float(np.sqrt((scene.velocity**2).sum(axis=1).max() + 2 * fall))


class Listener(Box2D.b2ContactListener):  # type: ignore[misc]
    def __init__(self, engine: Box2DEngine) -> None:
        super().__init__()
        self.engine = engine
        self.log: list[tuple[int, int, int, float]] = []

    def PostSolve(self, contact: Any, impulse: Any) -> None:
        # Called once per step for every touching pair, with or without an impulse.
        J = impulse.normalImpulses[0]
        if J > 0.0:
            i, j = contact.fixtureA.body.userData, contact.fixtureB.body.userData
            self.log.append((self.engine.steps, i, j, J))

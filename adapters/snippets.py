"""The settings of a library in a scene, as code to copy: what the adapter sets, in the words of the
binding that was run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import closing
from string import Template
from typing import Any

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.friction import of_shapes
from crosscheck2d.scenarios.model import Scene

PYMUNK = """\
import pymunk

space = pymunk.Space()
space.gravity = $gravity
$settings

def add_disk(position, velocity, radius, mass):
    body = pymunk.Body(mass, mass * radius**2 / 2)
    body.position, body.velocity = position, velocity
    shape = pymunk.Circle(body, radius)
    shape.elasticity, shape.friction = $elasticity, $friction
    space.add(body, shape)
    return body

def add_wall(start, end):
    shape = pymunk.Segment(space.static_body, start, end, 0.0)
    shape.elasticity, shape.friction = $elasticity, $friction
    space.add(shape)

def step():
    space.step($dt)

def position(body):
    return tuple(body.position)
"""
BOX2D = """\
import Box2D

length, time = $length, $time  # units of length in a metre, s in a unit of time
speed = length * time
x, y = $gravity
world = Box2D.b2World(gravity=(x * speed * time, y * speed * time))
world.continuousPhysics = $continuous
world.subStepping = $sub_stepping
world.warmStarting = $warm_starting
world.SetAllowSleeping($sleeping)  # the attribute doSleep does not reach the engine
surface = {"restitution": $restitution$friction}

def add_disk(position, velocity, radius, mass):
    (x, y), (u, v) = position, velocity
    body = world.CreateDynamicBody(
        position=(x * length, y * length),
        linearVelocity=(u * speed, v * speed),
        allowSleep=$sleeping,
        bullet=$bullet,
    )
    shape = Box2D.b2CircleShape(radius=radius * length)
    body.CreateFixture(Box2D.b2FixtureDef(shape=shape, density=1.0, **surface))
    inertia = mass * radius**2 / 2 * length**2
    body.massData = Box2D.b2MassData(mass=mass, center=(0, 0), I=inertia)
    return body

def add_wall(start, end):
    ends = [(x * length, y * length) for x, y in (start, end)]
    shape = Box2D.b2EdgeShape(vertices=ends)$skin
    world.CreateStaticBody().CreateFixture(Box2D.b2FixtureDef(shape=shape, **surface))

def step():
    world.Step($dt / time, $velocity_iterations, $position_iterations)

def position(body):
    x, y = body.position
    return x / length, y / length
"""
BOX2D_V3 = """\
import pyb2d3

pyb2d3.set_length_units_per_meter($unit)
world = pyb2d3.World(gravity=$gravity$options)
world.continuous_enabled = $continuous
world.sleeping_enabled = $sleeping
world.set_contact_tuning($tuning)  # hertz, damping ratio, push speed
material = pyb2d3.surface_material(restitution=$restitution$friction)

def add_disk(position, velocity, radius, mass):
    body = world.create_dynamic_body(
        position=position, linear_velocity=velocity, enable_sleep=$sleeping, is_bullet=$bullet
    )
    shape = pyb2d3.shape_def(density=1.0, material=material)
    body.create_circle_shape(shape, pyb2d3.circle(radius=radius))
    data = pyb2d3.MassData()
    data.mass, data.rotational_inertia, data.center = mass, mass * radius**2 / 2, (0.0, 0.0)
    body.mass_data = data
    return body

def add_wall(start, end):
    shape = pyb2d3.shape_def(density=1.0, material=material)
    world.create_static_body().create_segment_shape(shape, pyb2d3.segment(start, end))

def step():
    world.step($dt, $substeps)

def position(body):
    return tuple(body.position)
"""
PLANCK = """\
import * as planck from "planck";

Object.assign(planck.Settings, $settings);
const [x, y] = $gravity;
const world = new planck.World({
  gravity: { x, y }, allowSleep: $sleeping,
  continuousPhysics: $continuous, warmStarting: $warm_starting,
});
const surface = { density: 1, restitution: $restitution$friction };

function addDisk([x, y], [u, v], radius, mass) {
  const body = world.createBody({
    type: "dynamic", position: { x, y }, linearVelocity: { x: u, y: v }, bullet: $bullet,
  });
  body.createFixture({ shape: new planck.Circle(radius), ...surface });
  body.setMassData({ mass, center: { x: 0, y: 0 }, I: mass * radius ** 2 / 2 });
  return body;
}

function addWall([x0, y0], [x1, y1]) {
  const shape = new planck.Edge({ x: x0, y: y0 }, { x: x1, y: y1 });$skin
  world.createBody().createFixture({ shape, ...surface });
}

const step = () => world.step($dt, $iterations);
const position = (body) => [body.getPosition().x, body.getPosition().y];
"""
MATTER = """\
import Matter from "matter-js";

const scale = $scale;  // pixels in a metre
const [x, y] = $gravity;
const engine = Matter.Engine.create({
  gravity: { x, y, scale: scale * 1e-6 }, enableSleeping: $sleeping,
  positionIterations: $position_iterations, velocityIterations: $velocity_iterations,
});
const surface = { restitution: $restitution$friction };

function addDisk([x, y], [u, v], radius, mass) {
  const body = Matter.Bodies.circle(x * scale, y * scale, radius * scale, { ...surface }, $sides);
  Matter.Body.setMass(body, mass);
  Matter.Body.setInertia(body, mass * radius ** 2 / 2 * scale ** 2);
  body.deltaTime = $dt * 1000;
  Matter.Body.setVelocity(body, { x: u * scale / 60, y: v * scale / 60 });  // pixels in 1/60 s
  Matter.Composite.add(engine.world, body);
  return body;
}

function addWall([x0, y0], [x1, y1]) {
  const length = Math.hypot(x1 - x0, y1 - y0) * scale, angle = Math.atan2(y1 - y0, x1 - x0);
  const options = { ...surface, isStatic: true, angle };
  const at = [(x0 + x1) / 2 * scale, (y0 + y1) / 2 * scale];
  Matter.Composite.add(engine.world, Matter.Bodies.rectangle(...at, length, 1e-3, options));
}

const step = () => Matter.Engine.update(engine, $dt * 1000);
const position = (body) => [body.position.x / scale, body.position.y / scale];
"""
RAPIER = """\
import RAPIER from "@dimforge/rapier2d-compat";

await RAPIER.init();
const [x, y] = $gravity;
const world = new RAPIER.World({ x, y });
world.timestep = $dt;
$settings

function addShape(shape, body) {
  shape.setRestitution($restitution).setDensity(0)$friction;
  world.createCollider(shape, body);
  return body;
}

function addDisk([x, y], [u, v], radius, mass) {
  const body = RAPIER.RigidBodyDesc.dynamic().setTranslation(x, y).setLinvel(u, v)
    .setCanSleep($sleeping)
    .setAdditionalMassProperties(mass, { x: 0, y: 0 }, mass * radius ** 2 / 2);
  return addShape(RAPIER.ColliderDesc.ball(radius), world.createRigidBody(body));
}

function addWall([x0, y0], [x1, y1]) {
  const segment = RAPIER.ColliderDesc.segment({ x: x0, y: y0 }, { x: x1, y: y1 });
  addShape(segment, world.createRigidBody(RAPIER.RigidBodyDesc.fixed()));
}

const step = () => world.step();
const position = (body) => [body.translation().x, body.translation().y];
"""


def write_snippet(name: str, scene: Scene, dt: float) -> str:
    """Code that makes a world of the library of `engine:profile` with the settings that the adapter
    has for the scene at steps of `dt` s; "" for an engine that is no library."""
    library, _, profile = name.partition(":")
    if library not in TEMPLATES:
        return ""
    with closing(row_of(name).make()) as engine:
        engine.load(scene, dt)
        template, fields = TEMPLATES[library]
        package, version = next(iter(engine.versions().items()))
        python = template in (PYMUNK, BOX2D, BOX2D_V3)
        words = {"dt": dt, "gravity": scene.gravity.tolist(), "restitution": scene.restitution}
        words = {key: repr(value) if python else json.dumps(value) for key, value in words.items()}
        words |= fields(engine)
    comment = "#" if python else "//"
    note = f"{comment} {package} {version}, {profile}, for this scene at {dt * 1e3:.4g} ms a step"
    return f"{note}\n" + Template(template).substitute(words)


def _pymunk(engine: Any) -> dict[str, Any]:
    of_space = {k: v for k, v in engine.asked.items() if k not in ("elasticity", "friction")}
    lines = [f"space.{key} = {value!r}" for key, value in of_space.items()]
    return {"settings": "\n".join(lines), "gravity": tuple(engine.scene.gravity.tolist())} | {
        key: repr(engine.asked[key]) for key in ("elasticity", "friction")
    }


def _box2d(engine: Any) -> dict[str, Any]:
    names = "length time continuous sleeping bullet velocity_iterations position_iterations"
    return {name: getattr(engine, name) for name in names.split()} | {
        "sub_stepping": engine.chosen["sub_stepping"],
        "warm_starting": engine.chosen["warm_starting"],
        "skin": "" if engine.chosen["skin"] else "\n    shape.radius = 0.0",
        "friction": "" if engine.friction is None else f', "friction": {engine.friction!r}',
    }


def _box2d_v3(engine: Any) -> dict[str, Any]:
    return {
        "unit": engine.unit,
        "options": "".join(f", {key}={value!r}" for key, value in engine.options.items()),
        "tuning": ", ".join(map(repr, engine.tuning)),
        "gravity": tuple(engine.scene.gravity.tolist()),
        "continuous": engine.chosen["continuous"],
        "bullet": engine.chosen["bullet"],
        "friction": "" if engine.friction is None else f", friction={engine.friction!r}",
        "sleeping": engine.sleeping,
        "substeps": engine.substeps,
    }


def _read(engine: Any) -> tuple[dict[str, Any], dict[str, str]]:
    resolved = {name: value for name, (_, value) in engine.settings().items()}
    friction = of_shapes(engine.scene, engine.profile == "matched", None)
    stated = "" if friction is None else f", friction: {json.dumps(friction)}"
    return resolved, {"friction": stated}


def _chosen(profile: str, library: str) -> Mapping[str, Any]:
    searched = row_of(f"{library}:matched").searched
    return searched().chosen if searched is not None and profile == "matched" else {}


def _planck(engine: Any) -> dict[str, Any]:
    resolved, common = _read(engine)
    settings = "linearSlop maxLinearCorrection maxTranslation maxRotation aabbExtension baumgarte"
    settings += " velocityThreshold"
    return common | {
        "settings": json.dumps({name: resolved[name] for name in settings.split()}),
        "sleeping": json.dumps(resolved["sleeping"]),
        "continuous": json.dumps(resolved["continuous collision"]),
        "bullet": json.dumps(resolved["continuous collision between disks"]),
        "warm_starting": json.dumps(resolved["warm starting"]),
        "skin": "" if engine.profile == "shipped" else "\n  shape.m_radius = 0;",
        "iterations": engine.settings()["velocity, position iterations"][0],
    }


def _matter(engine: Any) -> dict[str, Any]:
    resolved, common = _read(engine)
    velocity, position = resolved["velocity, position iterations"].split(", ")
    if engine.profile == "matched":
        common["friction"] += ", frictionAir: 0"
    return common | {
        "scale": json.dumps(engine.settings()["pixels in a metre"][0]),
        "sleeping": json.dumps(resolved["sleeping"]),
        "sides": _chosen(engine.profile, "matter").get("sides", 25),
        "velocity_iterations": velocity,
        "position_iterations": position,
    }


def _rapier2d(engine: Any) -> dict[str, Any]:
    resolved, common = _read(engine)
    names = {
        "numSolverIterations": "iterations",
        "integrationParameters.numInternalPgsIterations": "pgs_iterations",
        "integrationParameters.maxCcdSubsteps": "continuous_steps",
        "integrationParameters.contact_natural_frequency": "hertz",
        "integrationParameters.normalizedPredictionDistance": "prediction",
    }
    chosen = _chosen(engine.profile, "rapier2d")
    settings = {"lengthUnit": resolved["length unit in m"]} if chosen else {}
    settings |= {name: chosen[key] for name, key in names.items() if key in chosen}
    lines = [f"world.{name} = {json.dumps(value)};" for name, value in settings.items()]
    matched = engine.profile == "matched"
    friction = of_shapes(engine.scene, matched, None)
    return common | {
        "settings": "\n".join(lines) or "// all else is Rapier's default",
        "friction": "" if friction is None else f".setFriction({json.dumps(friction)})",
        "sleeping": json.dumps(not matched),
    }


TEMPLATES: dict[str, Any] = {
    "pymunk": (PYMUNK, _pymunk),
    "box2d": (BOX2D, _box2d),
    "box2d_v3": (BOX2D_V3, _box2d_v3),
    "planck": (PLANCK, _planck),
    "matter": (MATTER, _matter),
    "rapier2d": (RAPIER, _rapier2d),
}

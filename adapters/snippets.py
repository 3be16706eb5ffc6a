"""The settings of a library in a scene, as code to copy: what the adapter sets, in the words of the
binding that was run."""

from __future__ import annotations

import json
from contextlib import closing
from typing import Any

from jinja2 import Environment, StrictUndefined

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.friction import of_shapes
from crosscheck2d.scenarios.model import Scene

PYMUNK = """\
import pymunk

space = pymunk.Space()
space.gravity = {{ gravity }}
{% for name, value in engine.asked.items() if name not in ("elasticity", "friction") %}
space.{{ name }} = {{ value }}
{% endfor %}

def add_disk(position, velocity, radius, mass):
    body = pymunk.Body(mass, mass * radius**2 / 2)
    body.position, body.velocity = position, velocity
    shape = pymunk.Circle(body, radius)
    shape.elasticity, shape.friction = {{ engine.asked.elasticity }}, {{ engine.asked.friction }}
    space.add(body, shape)
    return body

def add_wall(start, end):
    shape = pymunk.Segment(space.static_body, start, end, 0.0)
    shape.elasticity, shape.friction = {{ engine.asked.elasticity }}, {{ engine.asked.friction }}
    space.add(shape)

def step():
    space.step({{ dt }})

def position(body):
    return tuple(body.position)
"""
BOX2D = """\
import Box2D

length = {{ engine.length }}  # units of length in a metre
time = {{ engine.time }}  # s in a unit of time
speed = length * time
x, y = {{ gravity }}
world = Box2D.b2World(gravity=(x * speed * time, y * speed * time))
world.continuousPhysics = {{ engine.continuous }}
world.subStepping = {{ engine.chosen.sub_stepping }}
world.warmStarting = {{ engine.chosen.warm_starting }}
world.SetAllowSleeping({{ engine.sleeping }})  # the attribute doSleep does not reach the engine
surface = {{ surface }}

def add_disk(position, velocity, radius, mass):
    (x, y), (u, v) = position, velocity
    body = world.CreateDynamicBody(
        position=(x * length, y * length),
        linearVelocity=(u * speed, v * speed),
        allowSleep={{ engine.sleeping }},
        bullet={{ engine.bullet }},
    )
    shape = Box2D.b2CircleShape(radius=radius * length)
    body.CreateFixture(Box2D.b2FixtureDef(shape=shape, density=1.0, **surface))
    inertia = mass * radius**2 / 2 * length**2
    body.massData = Box2D.b2MassData(mass=mass, center=(0, 0), I=inertia)
    return body

def add_wall(start, end):
    ends = [(x * length, y * length) for x, y in (start, end)]
    shape = Box2D.b2EdgeShape(vertices=ends)
{% if not engine.chosen.skin %}
    shape.radius = 0.0
{% endif %}
    world.CreateStaticBody().CreateFixture(Box2D.b2FixtureDef(shape=shape, **surface))

def step():
    world.Step({{ dt }} / time, {{ engine.velocity_iterations }}, {{ engine.position_iterations }})

def position(body):
    x, y = body.position
    return x / length, y / length
"""
BOX2D_V3 = """\
import pyb2d3

pyb2d3.set_length_units_per_meter({{ engine.unit }})
world = pyb2d3.World(gravity={{ gravity }}
{%- for name, value in engine.options.items() %}, {{ name }}={{ value }}{% endfor %})
world.continuous_enabled = {{ engine.chosen.continuous }}
world.sleeping_enabled = {{ engine.sleeping }}
world.set_contact_tuning{{ engine.tuning }}  # hertz, damping ratio, push speed
surface = {{ surface }}
material = pyb2d3.surface_material(**surface)

def add_disk(position, velocity, radius, mass):
    body = world.create_dynamic_body(
        position=position, linear_velocity=velocity,
        enable_sleep={{ engine.sleeping }}, is_bullet={{ engine.chosen.bullet }},
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
    world.step({{ dt }}, {{ engine.substeps }})

def position(body):
    return tuple(body.position)
"""
PLANCK = """\
import * as planck from "planck";

Object.assign(planck.Settings, {
{% for name in ("linearSlop", "maxLinearCorrection", "maxTranslation", "maxRotation",
                "aabbExtension", "baumgarte", "velocityThreshold") %}
  {{ name }}: {{ resolved[name] }},
{% endfor %}
});
const [x, y] = {{ gravity }};
const world = new planck.World({
  gravity: { x, y }, allowSleep: {{ resolved.sleeping }},
  continuousPhysics: {{ resolved["continuous collision"] }},
  warmStarting: {{ resolved["warm starting"] }},
});
const surface = {{ surface }};

function addDisk([x, y], [u, v], radius, mass) {
  const body = world.createBody({
    type: "dynamic", position: { x, y }, linearVelocity: { x: u, y: v },
    bullet: {{ resolved["continuous collision between disks"] }},
  });
  body.createFixture({ shape: new planck.Circle(radius), density: 1, ...surface });
  body.setMassData({ mass, center: { x: 0, y: 0 }, I: mass * radius ** 2 / 2 });
  return body;
}

function addWall([x0, y0], [x1, y1]) {
  const shape = new planck.Edge({ x: x0, y: y0 }, { x: x1, y: y1 });
{% if matched %}
  shape.m_radius = 0;
{% endif %}
  world.createBody().createFixture({ shape, ...surface });
}

const step = () => world.step({{ dt }}, {{ asked["velocity, position iterations"] }});
const position = (body) => [body.getPosition().x, body.getPosition().y];
"""
MATTER = """\
import Matter from "matter-js";

const scale = {{ asked["pixels in a metre"] }};  // pixels in a metre
const sides = {{ chosen.get("sides", 25) }};
const [x, y] = {{ gravity }};
{% set velocity, position = resolved["velocity, position iterations"].split(", ") %}
const engine = Matter.Engine.create({
  gravity: { x, y, scale: scale * 1e-6 }, enableSleeping: {{ resolved.sleeping }},
  positionIterations: {{ position }}, velocityIterations: {{ velocity }},
});
const surface = {{ surface }};
{% if matched %}
surface.frictionAir = 0;
{% endif %}

function addDisk([x, y], [u, v], radius, mass) {
  const body = Matter.Bodies.circle(x * scale, y * scale, radius * scale, { ...surface }, sides);
  Matter.Body.setMass(body, mass);
  Matter.Body.setInertia(body, mass * radius ** 2 / 2 * scale ** 2);
  body.deltaTime = {{ dt }} * 1000;
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

const step = () => Matter.Engine.update(engine, {{ dt }} * 1000);
const position = (body) => [body.position.x / scale, body.position.y / scale];
"""
RAPIER = """\
import RAPIER from "@dimforge/rapier2d-compat";

await RAPIER.init();
const [x, y] = {{ gravity }};
const world = new RAPIER.World({ x, y });
world.timestep = {{ dt }};
{% if matched %}
world.lengthUnit = {{ resolved["length unit in m"] }};
{% endif %}
{% for name, key in (
    ("numSolverIterations", "iterations"),
    ("integrationParameters.numInternalPgsIterations", "pgs_iterations"),
    ("integrationParameters.maxCcdSubsteps", "continuous_steps"),
    ("integrationParameters.contact_natural_frequency", "hertz"),
    ("integrationParameters.normalizedPredictionDistance", "prediction"),
) if key in chosen %}
world.{{ name }} = {{ chosen[key] }};
{% else %}
// all else is Rapier's default
{% endfor %}

function addShape(shape, body) {
  shape.setDensity(0).setRestitution({{ surface.restitution }});
{% if surface.friction is defined %}
  shape.setFriction({{ surface.friction }});
{% endif %}
  world.createCollider(shape, body);
  return body;
}

function addDisk([x, y], [u, v], radius, mass) {
  const body = RAPIER.RigidBodyDesc.dynamic().setTranslation(x, y).setLinvel(u, v)
    .setCanSleep({{ not matched }})
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
TEMPLATES = {
    "pymunk": PYMUNK,
    "box2d": BOX2D,
    "box2d_v3": BOX2D_V3,
    "planck": PLANCK,
    "matter": MATTER,
    "rapier2d": RAPIER,
}


def write_snippet(name: str, scene: Scene, dt: float) -> str:
    """Code that makes a world of the library of `engine:profile` with the settings that the adapter
    has for the scene at steps of `dt` s; "" for an engine that is no library, and box2d_wasm."""
    library, _, profile = name.partition(":")
    if library not in TEMPLATES:
        return ""
    row, matched = row_of(name), profile == "matched"
    write, comment = (json.dumps, "//") if row.package else (repr, "#")

    def literal(value: Any) -> str:
        return value if isinstance(value, str) else write(value)

    made = Environment(
        trim_blocks=True, keep_trailing_newline=True, undefined=StrictUndefined, finalize=literal
    )
    surface, friction = {"restitution": scene.restitution}, of_shapes(scene, matched, None)
    if friction is not None:
        surface["friction"] = friction
    with closing(row.make()) as engine:
        engine.load(scene, dt)
        package, version = next(iter(engine.versions().items()))
        settings = engine.settings().items()
        code = made.from_string(TEMPLATES[library]).render(
            engine=engine,
            asked={setting: asked for setting, (asked, _) in settings},
            resolved={setting: used for setting, (_, used) in settings},
            chosen=row.searched().chosen if matched and row.searched else {},
            matched=matched,
            dt=dt,
            gravity=tuple(scene.gravity.tolist()),
            surface=surface,
        )
    note = f"{comment} {package} {version}, {profile}, for this scene at {dt * 1e3:.4g} ms a step"
    return f"{note}\n{code}"

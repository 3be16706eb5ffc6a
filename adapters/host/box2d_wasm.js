"use strict";
// Box2D after 3.1.1, float32, compiled to WebAssembly (npm box2d3-wasm): soft substeps, then one sweep for restitution.
// The package does not hand on its unit of length: lengths are given in another unit here.
{
  const { wasm } = module.exports;
  const common = {
    turning: true, substeps: 4, hertz: 30, damping_ratio: 10, push_speed: 3, continuous: true, bullet: false,
  };
  const shipped = { ...common, matched: false, sleeping: true, fast_rotation: false };
  // Matched as Box2D 3.1 is, and without a cap on spins: "this should only be used for circular objects, like wheels"
  // (b2BodyDef::allowFastRotation).
  const matched = {
    ...common, matched: true, sleeping: false, fast_rotation: true, length_unit: 0.3, hertz: 120, damping_ratio: 1,
  };
  const profiles = { shipped, matched };
  let Box2D;
  module.exports({ wasmBinary: Uint8Array.fromBase64(wasm), locateFile: (name) => name }).then((made) => { Box2D = made; });
  globalThis.ready = () => Box2D !== undefined;

  // What a function of Box2D returns is deleted once it is read, and what it is given once it has it.
  function using(made, use) {
    const result = use(made);
    made.delete();
    return result;
  }

  const vector = ([x, y], scale, use) => using(new Box2D.b2Vec2(x * scale, y * scale), use);
  const pair = (made, scale) => using(made, ({ x, y }) => [x / scale, y / scale]);
  const fixed = (scene, i) => scene.mass[i] === Infinity;

  globalThis.models = "disks walls gravity static forces rotation friction wrap";
  globalThis.create = (scene, dt) => {
    const chosen = { ...profiles[scene.profile], ...scene.changed };
    const scale = chosen.length_unit ? 1 / (chosen.length_unit * Math.min(...scene.radius)) : 1;  // units in a metre
    const space = using(Box2D.b2DefaultWorldDef(), (definition) => {
      vector(scene.gravity, scale, (gravity) => { definition.gravity = gravity; });
      if (chosen.matched) Object.assign(definition, { restitutionThreshold: 0, maximumLinearSpeed: 1e9 * scale });
      return Box2D.b2CreateWorld(definition);
    });
    Box2D.b2World_EnableSleeping(space, chosen.sleeping);
    Box2D.b2World_EnableContinuous(space, chosen.continuous);
    Box2D.b2World_SetContactTuning(space, chosen.hertz, chosen.damping_ratio, chosen.push_speed * scale);
    Box2D.b2World_SetHitEventThreshold(space, 0);  // every collision is reported
    const friction = scene.own_friction, index = new Map();  // null: the engine's own default

    function body(position, set) {
      return using(Box2D.b2DefaultBodyDef(), (definition) => {
        vector(position, scale, (at) => { definition.position = at; });
        set(definition);
        return Box2D.b2CreateBody(space, definition);
      });
    }

    function shape(i, on, create, geometry) {
      return using(Box2D.b2DefaultShapeDef(), (definition) => using(definition.material, (material) => {
        material.restitution = scene.restitution;
        if (friction !== null) material.friction = friction;
        Object.assign(definition, { material, density: 1, enableHitEvents: scene.listening });
        const id = using(geometry, () => create(on, definition, geometry));
        index.set(id.index1, i);
        return id;
      }));
    }

    function disk(position, i) {
      const made = body(position, (definition) => {
        using(new Box2D.b2Rot(), (turn) => {
          Object.assign(turn, { c: Math.cos(scene.angle[i]), s: Math.sin(scene.angle[i]) });
          definition.rotation = turn;
        });
        if (fixed(scene, i)) return;
        vector(scene.velocity[i], scale, (velocity) => { definition.linearVelocity = velocity; });
        Object.assign(definition, {
          type: Box2D.b2BodyType.b2_dynamicBody, angularVelocity: scene.angular_velocity[i], enableSleep: chosen.sleeping,
          isBullet: chosen.bullet, allowFastRotation: chosen.fast_rotation,
        });
      });
      const circle = new Box2D.b2Circle();
      vector([0, 0], 1, (center) => Object.assign(circle, { center, radius: scene.radius[i] * scale }));
      shapes.push(shape(i, made, Box2D.b2CreateCircleShape, circle));
      if (fixed(scene, i)) return made;
      // After the shape: adding one computes mass and inertia from its density.
      const rotationalInertia = chosen.turning ? (scene.inertia[i] < Infinity ? scene.inertia[i] : 1) * scale ** 2 : 0;
      using(new Box2D.b2MassData(), (mass) => {
        vector([0, 0], 1, (center) => Object.assign(mass, { center, mass: scene.mass[i], rotationalInertia }));
        Box2D.b2Body_SetMassData(made, mass);
      });
      return made;
    }

    const shapes = [], bodies = scene.position.map(disk);
    scene.walls.forEach(([start, end], w) => {
      const segment = new Box2D.b2Segment();
      vector(start, scale, (point) => { segment.point1 = point; });
      vector(end, scale, (point) => { segment.point2 = point; });
      shape(-1 - w, body([0, 0], () => {}), Box2D.b2CreateSegmentShape, segment);
    });
    // It keeps cos and sin: the angle is the one nearest to where the mean spin since the last reading would have
    // brought it.
    const turned = scene.angle.map((angle, i) => ({ angle, spin: scene.angular_velocity[i], step: 0 }));
    return { scene, chosen, scale, space, bodies, shapes, index, turned, friction, dt, steps: 0, heard: [] };
  };

  globalThis.step = (world, dt, forces) => {
    const { space, bodies, scale, index, chosen, scene } = world;
    world.heard = [];
    forces.forEach(([x, y, torque], i) => {
      if (!x && !y && !torque) return;
      vector([x, y], scale, (force) => Box2D.b2Body_ApplyForceToCenter(bodies[i], force, true));
      Box2D.b2Body_ApplyTorque(bodies[i], torque * scale ** 2, true);
    });
    Box2D.b2World_Step(space, dt, chosen.substeps);
    world.steps++;
    if (!scene.listening) return;
    using(Box2D.b2World_GetContactEvents(space), (events) => {  // which tell the speed, and no impulse
      for (let k = 0; k < events.hitCount; k++) {
        using(events.GetHitEvent(k), ({ shapeIdA, shapeIdB }) => {
          world.heard.push([index.get(shapeIdA.index1), index.get(shapeIdB.index1), NaN]);
        });
      }
    });
  };

  function angle({ turned, bodies, steps, dt }, i, spin) {
    const before = turned[i], raw = using(Box2D.b2Body_GetRotation(bodies[i]), ({ c, s }) => Math.atan2(s, c));
    const expected = before.angle + (before.spin + spin) / 2 * (steps - before.step) * dt;
    turned[i] = { angle: raw + 2 * Math.PI * Math.round((expected - raw) / (2 * Math.PI)), spin, step: steps };
    return turned[i].angle;
  }

  globalThis.read = (world) => {
    const angular_velocity = world.bodies.map(Box2D.b2Body_GetAngularVelocity);
    return {
      position: world.bodies.map((body) => pair(Box2D.b2Body_GetPosition(body), world.scale)),
      velocity: world.bodies.map((body) => pair(Box2D.b2Body_GetLinearVelocity(body), world.scale)),
      angle: angular_velocity.map((spin, i) => angle(world, i, spin)),
      angular_velocity,
    };
  };

  globalThis.collisions = ({ heard }) => heard;

  globalThis.place = ({ bodies, scale }, i, x, y) => {
    const body = bodies[i];
    using(Box2D.b2Body_GetRotation(body), (turn) => vector([x, y], scale, (at) => Box2D.b2Body_SetTransform(body, at, turn)));
  };

  globalThis.free = ({ space }) => Box2D.b2DestroyWorld(space);

  globalThis.settings = ({ scene, chosen, scale, space, bodies, shapes, friction, dt }) => {
    const asked = (value) => (chosen.matched ? value : null);
    return [
      ["length unit in m", asked(1 / scale), "kept by the adapter"],
      ["restitution threshold in m/s", asked(0), Box2D.b2World_GetRestitutionThreshold(space) / scale],
      ["speed cap in m/s", asked(1e9), Box2D.b2World_GetMaximumLinearSpeed(space) / scale],
      ["spin cap in rad/s", null, chosen.fast_rotation ? "none" : Math.PI / 4 / dt],
      ["contact tuning (hertz, damping ratio, push speed in m/s)",
        asked(`${chosen.hertz}, ${chosen.damping_ratio}, ${chosen.push_speed}`), "not readable"],
      ["friction", friction, Box2D.b2Shape_GetFriction(shapes[0])],
      ["restitution", scene.restitution, Box2D.b2Shape_GetRestitution(shapes[0])],
      ["sleeping", asked(chosen.sleeping), Box2D.b2World_IsSleepingEnabled(space)],
      ["continuous collision", asked(chosen.continuous), Box2D.b2World_IsContinuousEnabled(space)],
      ["continuous collision between disks", asked(chosen.bullet), bodies.some(Box2D.b2Body_IsBullet)],
      ["substeps", chosen.substeps, "passed with every step"],
    ];
  };
}

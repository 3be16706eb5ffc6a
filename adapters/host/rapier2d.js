"use strict";
// Rapier 0.21 for JavaScript, float32, from Rust through WebAssembly: four substeps, contacts foreseen within a margin.
{
  const RAPIER = module.exports.default || module.exports;
  // Walls stop fast disks unless continuous_steps is 0; `continuous` is for pairs of disks.
  const shipped = {
    matched: false, turning: true, sleeping: true, iterations: null, continuous: false,
    continuous_steps: null, pgs_iterations: null, soft_ccd: 0, hertz: null, prediction: null,
  };
  // The length unit is that of Box2D 3.1, matched, whose slop and margin are the same shares of theirs.
  const matched = {
    matched: true, turning: true, sleeping: false, iterations: 4, continuous: false, length_unit: 0.5,
    continuous_steps: 1, pgs_iterations: 1, soft_ccd: 0, hertz: 120, prediction: 0.02,
  };

  globalThis.models = "disks walls gravity static forces rotation friction wrap";
  globalThis.create = (scene, dt) => {
    const chosen = { ...profiles[scene.profile], ...scene.changed };
    const { restitution, own_friction: friction } = scene;  // null: the engine's own default
    const fixed = (i) => scene.mass[i] === Infinity;
    const space = new RAPIER.World(vector(scene.gravity));
    space.timestep = dt;
    const parameters = space.integrationParameters;
    set(space, {
      lengthUnit: chosen.length_unit ? chosen.length_unit * Math.min(...scene.radius) : null,
      numSolverIterations: chosen.iterations,
    });
    set(parameters, {
      maxCcdSubsteps: chosen.continuous_steps, numInternalPgsIterations: chosen.pgs_iterations,
      contact_natural_frequency: chosen.hertz, normalizedPredictionDistance: chosen.prediction,
    });
    const index = new Map();
    const add = (shape, body, i) => {
      shape.setRestitution(restitution).setDensity(0);
      if (friction !== null) shape.setFriction(friction);
      if (scene.listening) shape.setActiveEvents(RAPIER.ActiveEvents.CONTACT_FORCE_EVENTS).setContactForceEventThreshold(0);
      const collider = space.createCollider(shape, body);
      index.set(collider.handle, i);
      return collider;
    };
    const bodies = scene.position.map(([x, y], i) => {
      const kind = fixed(i) ? RAPIER.RigidBodyDesc.fixed() : RAPIER.RigidBodyDesc.dynamic();
      kind.setTranslation(x, y).setRotation(scene.angle[i]).setCanSleep(chosen.sleeping).setCcdEnabled(chosen.continuous);
      if (chosen.soft_ccd) kind.setSoftCcdPrediction(chosen.soft_ccd * Math.min(...scene.radius));
      if (!fixed(i)) {
        kind.setLinvel(...scene.velocity[i]).setAngvel(scene.angular_velocity[i]);
        kind.setAdditionalMassProperties(scene.mass[i], { x: 0, y: 0 }, chosen.turning ? finite(scene.inertia[i]) : 0);
      }
      return space.createRigidBody(kind);
    });
    const colliders = bodies.map((body, i) => add(RAPIER.ColliderDesc.ball(scene.radius[i]), body, i));
    scene.walls.forEach(([start, end], w) => {
      const body = space.createRigidBody(RAPIER.RigidBodyDesc.fixed());
      add(RAPIER.ColliderDesc.segment(vector(start), vector(end)), body, -1 - w);
    });
    const queue = scene.listening ? new RAPIER.EventQueue(true) : undefined;
    // What it cuts speeds and spins at: 400 length units a second, an eighth of a turn a step.
    const caps = { speed: 400 * space.lengthUnit, spin: Math.PI / 4 / dt };
    // It keeps cos and sin: the angle is the one nearest to where the mean spin since the last reading would have
    // brought it.
    const turned = scene.angle.map((angle, i) => ({ angle, spin: scene.angular_velocity[i], step: 0 }));
    return { chosen, space, bodies, colliders, index, queue, caps, turned, friction, restitution, dt, steps: 0, heard: [] };
  };

  function mustNotBeCut({ chosen, caps, space }, what, value, unit) {
    // float32 leaves what was cut a little below the cap
    if (!chosen.matched || !(Math.abs(value) > caps[what] * (1 - 1e-5))) return;
    const cap = {
      speed: `at which Rapier cuts speeds: 400 of its length units of ${+space.lengthUnit.toPrecision(4)} m a second`
        + " (normalized_max_linear_velocity of the crate, which the npm package does not hand on)",
      spin: "the most that Rapier allows at this dt: an eighth of a turn",
    };
    throw new Refused(`a disk reaches a ${what} of ${+caps[what].toPrecision(6)} ${unit}, ${cap[what]}`);
  }

  function angle({ turned, bodies, steps, dt }, i) {
    const before = turned[i], spin = bodies[i].angvel(), raw = bodies[i].rotation();
    const expected = before.angle + (before.spin + spin) / 2 * (steps - before.step) * dt;
    turned[i] = { angle: raw + 2 * Math.PI * Math.round((expected - raw) / (2 * Math.PI)), spin, step: steps };
    return turned[i].angle;
  }

  globalThis.step = (world, dt, forces) => {
    const { space, bodies, index, queue } = world, forced = [];
    world.heard = [];
    forces.forEach(([x, y, torque], i) => {
      if (!x && !y && !torque) return;
      bodies[i].addForce({ x, y }, true);
      bodies[i].addTorque(torque, true);
      forced.push(bodies[i]);
    });
    space.step(queue);
    if (queue) {
      queue.drainContactForceEvents((event) => {
        world.heard.push([index.get(event.collider1()), index.get(event.collider2()), event.totalForceMagnitude() * dt]);
      });
    }
    for (const body of forced) {
      body.resetForces(true);
      body.resetTorques(true);
    }
    world.steps++;
  };

  globalThis.read = (world) => {
    const state = { position: [], velocity: [], angle: [], angular_velocity: [] };
    world.bodies.forEach((body, i) => {
      const { x, y } = body.translation(), v = body.linvel();
      mustNotBeCut(world, "speed", Math.hypot(v.x, v.y), "m/s");
      mustNotBeCut(world, "spin", body.angvel(), "rad/s");
      state.position[i] = [x, y];
      state.velocity[i] = [v.x, v.y];
      state.angle[i] = angle(world, i);
      state.angular_velocity[i] = body.angvel();
    });
    return state;
  };

  globalThis.collisions = ({ heard }) => heard;

  globalThis.place = ({ bodies }, i, x, y) => bodies[i].setTranslation({ x, y }, true);

  globalThis.free = ({ queue, space }) => {
    if (queue) queue.free();
    space.free();
  };

  globalThis.settings = ({ chosen, space, bodies, colliders, caps, friction, restitution }) => {
    const p = space.integrationParameters;
    return [
      ["length unit in m", chosen.matched ? p.lengthUnit : null, p.lengthUnit],
      ["allowed linear error in m", null, p.normalizedAllowedLinearError * p.lengthUnit],
      ["prediction distance in m", null, p.normalizedPredictionDistance * p.lengthUnit],
      ["speed cap in m/s", null, caps.speed],
      ["spin cap in rad/s", null, caps.spin],
      ["solver iterations", chosen.iterations, p.numSolverIterations],
      ["passes of a solver iteration", chosen.pgs_iterations, p.numInternalPgsIterations],
      ["natural frequency of a contact in Hz", chosen.hertz, "not readable"],
      ["friction", friction, colliders[0].friction()],
      ["restitution", restitution, colliders[0].restitution()],
      ["sleeping", chosen.matched ? chosen.sleeping : null, "not readable"],
      ["steps of continuous collision", chosen.continuous_steps, p.maxCcdSubsteps],
      ["continuous collision", chosen.matched ? chosen.continuous : null, bodies.some((body) => body.isCcdEnabled())],
    ];
  };

  // What is chosen, of the settings that this version has.
  function set(target, values) {
    for (const [name, value] of Object.entries(values)) if (value !== null && name in target) target[name] = value;
  }

  const vector = ([x, y]) => ({ x, y });
  const finite = (I) => (I < Infinity ? I : 1);
  const profiles = { shipped, matched };
  let loaded = false;
  RAPIER.init().then(() => { loaded = true; });
  globalThis.ready = () => loaded;
}

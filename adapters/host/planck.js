"use strict";
// planck 1.5, Box2D 2.3 in float64: collide at the old position, then one velocity solve, then position correction.
// Box2D's compiled-in lengths and speeds can be set here: lengths are shares of `unit` m, so that in the units of
// adapters/box2d.py (`step_unit`, `time_unit`) the two differ by the rounding alone.
{
  const planck = module.exports;
  const common = { velocity_iterations: 8, position_iterations: 3, warm_starting: true, turning: true, baumgarte: 0.2 };
  const shipped = {
    ...common, continuous: true, bullet: false, sleeping: true, skin: true, matched: false,
  };
  const matched = {
    ...common, continuous: true, bullet: true, sleeping: false, skin: false, matched: true,
    length_unit: 1e-5, step_unit: 0, time_unit: 1000,
  };
  const DEFAULTS = {
    linearSlop: 0.005, maxLinearCorrection: 0.2, maxTranslation: 2, maxRotation: Math.PI / 2, aabbExtension: 0.1,
    velocityThreshold: 1,
  };

  // m/s, of the fastest disk if it falls through the whole height of the scene: as in adapters/box2d.py.
  function fastest({ position, walls, velocity, gravity }) {
    const heights = [...position, ...walls.flat()].map(([x, y]) => x * gravity[0] + y * gravity[1]);
    const fall = Math.max(...heights) - Math.min(...heights);
    return Math.sqrt(Math.max(...velocity.map(([u, v]) => u * u + v * v)) + 2 * fall);
  }

  // The settings are of the library, not of a world: every world sets all of them.
  function set(scene, dt, chosen) {
    const settings = { ...DEFAULTS, baumgarte: chosen.baumgarte };
    if (chosen.matched) {
      const least = chosen.length_unit * Math.min(...scene.radius);
      const unit = Math.max(least, chosen.step_unit * fastest(scene) * dt);
      for (const name of ["linearSlop", "maxLinearCorrection", "aabbExtension"]) settings[name] *= unit;
      settings.velocityThreshold = unit / chosen.time_unit;
      settings.maxTranslation = settings.maxRotation = 1e9;
    }
    for (const name of Object.keys(DEFAULTS)) if (name in chosen) settings[name] = chosen[name];
    for (const name of Object.keys(settings)) if (name in planck.Settings) planck.Settings[name] = settings[name];
  }

  globalThis.models = "disks walls gravity static forces rotation friction wrap";
  globalThis.create = (scene, dt) => {
    const chosen = { ...profiles[scene.profile], ...scene.changed }, heard = [];
    const { restitution, own_friction: friction } = scene;  // null: the engine's own default
    const { continuous, bullet, position_iterations: iterations } = chosen;
    const fixed = (i) => scene.mass[i] === Infinity;
    set(scene, dt, chosen);
    const space = new planck.World({
      gravity: vector(scene.gravity), allowSleep: chosen.sleeping, continuousPhysics: continuous,
      warmStarting: chosen.warm_starting,
    });
    const surface = { restitution, density: 1, ...(friction === null ? {} : { friction }) };
    const bodies = scene.position.map((position, i) => {
      const body = space.createBody({
        type: fixed(i) ? "static" : "dynamic", position: vector(position), angle: scene.angle[i], bullet,
        linearVelocity: vector(scene.velocity[i]), angularVelocity: scene.angular_velocity[i], userData: i,
      });
      body.createFixture({ shape: new planck.Circle(scene.radius[i]), ...surface });
      // After the fixture: adding one computes mass and inertia from its density.
      const I = chosen.turning ? finite(scene.inertia[i]) : 0;
      if (!fixed(i)) body.setMassData({ mass: scene.mass[i], center: { x: 0, y: 0 }, I });
      return body;
    });
    const walls = scene.walls.map(([start, end], w) => {
      const body = space.createBody({ userData: -1 - w });
      const shape = new planck.Edge(vector(start), vector(end));
      if (!chosen.skin) shape.m_radius = 0;
      body.createFixture({ shape, ...surface });
      return body;
    });
    if (scene.listening) {
      space.on("post-solve", (contact, { normalImpulses }) => {
        const of = (fixture) => fixture.getBody().getUserData();
        heard.push([of(contact.getFixtureA()), of(contact.getFixtureB()), normalImpulses[0]]);
      });
    }
    // A transform keeps the angle only up to whole turns.
    const turns = scene.angle.map((angle, i) => whole(angle - bodies[i].getAngle()));
    return { chosen, space, bodies, walls, turns, heard, friction, restitution, continuous, bullet, iterations, dt };
  };

  const angle = ({ bodies, turns }, i) => bodies[i].getAngle() + turns[i];

  globalThis.step = ({ space, bodies, heard, chosen, iterations }, dt, forces) => {
    heard.length = 0;
    forces.forEach(([x, y, torque], i) => {
      if (!x && !y && !torque) return;
      bodies[i].applyForceToCenter({ x, y }, true);
      bodies[i].applyTorque(torque, true);
    });
    space.step(dt, chosen.velocity_iterations, iterations);
  };

  globalThis.read = (world) => ({
    position: world.bodies.map((body) => pair(body.getPosition())),
    velocity: world.bodies.map((body) => pair(body.getLinearVelocity())),
    angle: world.bodies.map((_, i) => angle(world, i)),
    angular_velocity: world.bodies.map((body) => body.getAngularVelocity()),
  });

  globalThis.collisions = ({ heard }) => heard;

  globalThis.place = (world, i, x, y) => {
    const before = angle(world, i), body = world.bodies[i];
    body.setTransform({ x, y }, body.getAngle());
    world.turns[i] = whole(before - body.getAngle());
  };

  globalThis.settings = (world) => {
    const { chosen, space, bodies, walls, friction, restitution, continuous, bullet, iterations, dt } = world;
    return [
      ...Object.keys(DEFAULTS).map((name) => [name, chosen.matched ? planck.Settings[name] : null, planck.Settings[name]]),
      ["speed cap in m/s", null, planck.Settings.maxTranslation / dt],
      ["baumgarte", chosen.matched ? chosen.baumgarte : null, planck.Settings.baumgarte],
      ["wall skin in m", chosen.skin ? null : 0, walls.length ? walls[0].getFixtureList().getShape().getRadius() : "no wall"],
      ["friction", friction, bodies[0].getFixtureList().getFriction()],
      ["restitution", restitution, bodies[0].getFixtureList().getRestitution()],
      ["sleeping", chosen.matched ? chosen.sleeping : null, space.getAllowSleeping()],
      ["continuous collision", chosen.matched ? continuous : null, space.getContinuousPhysics()],
      ["continuous collision between disks", chosen.matched ? bullet : null, bodies.some((body) => body.isBullet())],
      ["warm starting", chosen.matched ? chosen.warm_starting : null, space.getWarmStarting()],
      ["velocity, position iterations", `${chosen.velocity_iterations}, ${iterations}`, "passed with every step"],
    ];
  };

  const whole = (angle) => 2 * Math.PI * Math.round(angle / (2 * Math.PI));
  const vector = ([x, y]) => ({ x, y });
  const pair = ({ x, y }) => [x, y];
  const finite = (I) => (I < Infinity ? I : 1);
  const profiles = { shipped, matched };
}

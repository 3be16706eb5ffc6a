"use strict";
// matter-js 0.20, float64: Verlet integration, then collide, position correction, one velocity solve. It thinks in
// pixels and in speeds of pixels in 1/60 s, and keeps no velocity but two positions. Circles are polygons, a wall is a
// rectangle; a pair has the greater restitution, the lesser friction.
{
  const Matter = module.exports;
  const BASE = 1000 / 60;  // ms, in which matter's speeds are
  const RESTING = Matter.Resolver._restingThresh;  // of the library, not of a world: every world sets it
  const THIN = 1e-3;  // pixels, of a wall: it has no segments
  const common = {
    turning: true, position_iterations: 6, velocity_iterations: 4, sleeping: false,
    slop: null, resting: RESTING,
  };
  // A hundred pixels in a metre, as in a page; its own friction of the air, static friction and number of sides.
  const shipped = { ...common, matched: false, pixels: 100, friction_air: null, friction_static: null, sides: 25 };
  // As many pixels in the smallest radius as lift its thresholds, all lengths of its own; and many sides.
  const matched = {
    ...common, matched: true, pixels_in_radius: 1e5, friction_air: 0, friction_static: null, sides: 200,
    position_iterations: 12, velocity_iterations: 8,
  };

  globalThis.models = "disks walls gravity static forces rotation friction wrap";
  globalThis.create = (scene, dt) => {
    const chosen = { ...profiles[scene.profile], ...scene.changed }, heard = [];
    const { restitution, own_friction: friction } = scene;  // null: the engine's own default
    const fixed = (i) => scene.mass[i] === Infinity;
    const scale = chosen.matched ? chosen.pixels_in_radius / Math.min(...scene.radius) : chosen.pixels;
    const speed = scale * BASE / 1000, spin = BASE / 1000, force = scale * 1e-6;
    Matter.Resolver._restingThresh = chosen.resting;
    const engine = Matter.Engine.create({
      positionIterations: chosen.position_iterations, velocityIterations: chosen.velocity_iterations,
      enableSleeping: chosen.sleeping,
      gravity: { x: scene.gravity[0], y: scene.gravity[1], scale: force },
    });
    const set = {
      friction, frictionAir: chosen.friction_air, frictionStatic: chosen.friction_static, slop: chosen.slop,
    };
    const surface = () => ({
      restitution, ...Object.fromEntries(Object.entries(set).filter(([, value]) => value !== null)),
    });
    const index = new Map();
    const bodies = scene.position.map(([x, y], i) => {
      const options = { ...surface(), isStatic: fixed(i) };
      const body = Matter.Bodies.circle(x * scale, y * scale, scene.radius[i] * scale, options, chosen.sides);
      index.set(body.id, i);
      Matter.Body.setAngle(body, scene.angle[i]);
      if (fixed(i)) return body;
      Matter.Body.setMass(body, scene.mass[i]);
      Matter.Body.setInertia(body, chosen.turning ? finite(scene.inertia[i]) * scale ** 2 : Infinity);
      body.deltaTime = dt * 1000;  // so that its first step is as long as the others
      Matter.Body.setVelocity(body, { x: scene.velocity[i][0] * speed, y: scene.velocity[i][1] * speed });
      Matter.Body.setAngularVelocity(body, scene.angular_velocity[i] * spin);
      return body;
    });
    const walls = scene.walls.map(([[x0, y0], [x1, y1]], w) => {
      const length = Math.hypot(x1 - x0, y1 - y0) * scale;
      const options = { ...surface(), isStatic: true, angle: Math.atan2(y1 - y0, x1 - x0) };
      const body = Matter.Bodies.rectangle((x0 + x1) / 2 * scale, (y0 + y1) / 2 * scale, length, THIN, options);
      index.set(body.id, -1 - w);
      return body;
    });
    Matter.Composite.add(engine.world, [...bodies, ...walls]);
    if (scene.listening) {
      // Its events tell who meets whom, and no impulse.
      Matter.Events.on(engine, "collisionStart", ({ pairs }) => {
        for (const { bodyA, bodyB } of pairs) heard.push([index.get(bodyA.id), index.get(bodyB.id), NaN]);
      });
    }
    return { chosen, engine, bodies, heard, scale, speed, spin, force, friction, restitution };
  };

  globalThis.step = ({ engine, bodies, heard, scale, force }, dt, forces) => {
    heard.length = 0;
    forces.forEach(([x, y, torque], i) => {
      bodies[i].force.x += x * force;
      bodies[i].force.y += y * force;
      bodies[i].torque += torque * scale * force;
    });
    Matter.Engine.update(engine, dt * 1000);
  };

  globalThis.read = ({ bodies, scale, speed, spin }) => ({
    position: bodies.map(({ position }) => [position.x / scale, position.y / scale]),
    velocity: bodies.map((body) => {
      const v = Matter.Body.getVelocity(body);
      return [v.x / speed, v.y / speed];
    }),
    angle: bodies.map((body) => body.angle),
    angular_velocity: bodies.map((body) => Matter.Body.getAngularVelocity(body) / spin),
  });

  globalThis.collisions = ({ heard }) => heard;

  globalThis.place = ({ bodies, scale }, i, x, y) => Matter.Body.setPosition(bodies[i], { x: x * scale, y: y * scale });

  globalThis.settings = ({ chosen, engine, bodies, scale, speed, friction, restitution }) => [
    ["pixels in a metre", scale, "kept by the adapter"],
    ["resting threshold in m/s, at this dt", null, Matter.Resolver._restingThresh / speed],
    ["slop in m", null, bodies[0].slop / scale],
    ["sides of the polygon of a disk", chosen.matched ? chosen.sides : null, bodies[0].vertices.length],
    ["thickness of a wall in m", THIN / scale, "kept by the adapter"],
    ["friction", friction, bodies[0].friction],
    ["static friction", chosen.friction_static, bodies[0].frictionStatic],
    ["friction of the air", chosen.friction_air, bodies[0].frictionAir],
    ["restitution", restitution, bodies[0].restitution],
    ["sleeping", chosen.matched ? chosen.sleeping : null, engine.enableSleeping],
    ["velocity, position iterations", null, `${engine.velocityIterations}, ${engine.positionIterations}`],
  ];

  const finite = (I) => (I < Infinity ? I : 1);
  const profiles = { shipped, matched };
}

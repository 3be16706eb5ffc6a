// An engine for crosscheck: symplectic Euler; overlaps are corrected, and each collision is one impulse.
// Units: m, s, kg, rad; y up. To judge it: crosscheck run bouncing_ball_e09 --engine THIS_FILE --engine pymunk
// What a scene may have; a scene with more is refused. Words: disks walls gravity static forces rotation friction wrap
const models = "disks walls gravity static forces rotation wrap";

// A new world for a scene, in steps of dt. A text instead of a world says why it cannot play the scene.
function create(scene, dt) {
  const disks = scene.position.map(([x, y], i) => ({
    i, x, y, u: scene.velocity[i][0], v: scene.velocity[i][1], angle: scene.angle[i], spin: scene.angular_velocity[i],
    radius: scene.radius[i], light: 1 / scene.mass[i], easy: 1 / scene.inertia[i],  // 0 for a disk that cannot move
  }));
  return { disks, walls: scene.walls, gravity: scene.gravity, e: scene.restitution, wrap: scene.wrap, heard: [] };
}

// One step. forces[i] is [x, y, torque], what acts on disk i during this step; a function need not use all it is given.
function step(world, dt, forces) {
  const { disks, walls, gravity, wrap } = world;
  world.heard = [];
  for (const d of disks) {
    if (d.light === 0) continue;
    d.u += (gravity[0] + forces[d.i][0] * d.light) * dt;
    d.v += (gravity[1] + forces[d.i][1] * d.light) * dt;
    d.spin += forces[d.i][2] * d.easy * dt;
    d.x += d.u * dt;
    d.y += d.v * dt;
    d.angle += d.spin * dt;
  }
  for (const a of disks) for (const b of disks) if (a.i < b.i) collide(world, a, b, b.i);
  for (const a of disks) walls.forEach((wall, w) => collide(world, a, nearest(wall, a), -1 - w));
  if (wrap) for (const d of disks) {  // beyond an edge: on from the opposite one
    const width = wrap[1][0] - wrap[0][0], height = wrap[1][1] - wrap[0][1];
    d.x += d.x < wrap[0][0] ? width : d.x > wrap[1][0] ? -width : 0;
    d.y += d.y < wrap[0][1] ? height : d.y > wrap[1][1] ? -height : 0;
  }
}

// The point of a wall that is nearest to a disk, as a disk without radius that cannot move.
function nearest([[ax, ay], [bx, by]], d) {
  const ux = bx - ax, uy = by - ay;
  const along = Math.min(Math.max(((d.x - ax) * ux + (d.y - ay) * uy) / (ux * ux + uy * uy), 0), 1);
  return { x: ax + along * ux, y: ay + along * uy, u: 0, v: 0, radius: 0, light: 0 };
}

function collide(world, a, b, j) {
  const dx = a.x - b.x, dy = a.y - b.y, distance = Math.hypot(dx, dy), light = a.light + b.light;
  const overlap = a.radius + b.radius - distance;
  if (overlap <= 0 || light === 0) return;
  const nx = distance ? dx / distance : 1, ny = distance ? dy / distance : 0;
  const closing = (a.u - b.u) * nx + (a.v - b.v) * ny;
  for (const [d, sign] of [[a, 1], [b, -1]]) {
    d.x += sign * nx * overlap * d.light / light;
    d.y += sign * ny * overlap * d.light / light;
  }
  if (closing >= 0) return;
  const impulse = -(1 + world.e) * closing / light;
  for (const [d, sign] of [[a, 1], [b, -1]]) {
    d.u += sign * nx * impulse * d.light;
    d.v += sign * ny * impulse * d.light;
  }
  world.heard.push([a.i, j, impulse]);
}

// Where everything is, in the scene's order. Without the word rotation, position and velocity are enough.
function read({ disks }) {
  return {
    position: disks.map((d) => [d.x, d.y]), velocity: disks.map((d) => [d.u, d.v]),
    angle: disks.map((d) => d.angle), angular_velocity: disks.map((d) => d.spin),
  };
}

// Optional. The collisions of the last step: [disk i, disk j or wall w as -1 - w, impulse in N s].
function collisions(world) {
  return world.heard;
}

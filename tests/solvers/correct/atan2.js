// Angles: the line of centres by atan2, velocities turned into its frame and back; only the two tasks.
function turn(v, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return { x: c * v.x - s * v.y, y: s * v.x + c * v.y };
}

function integrate(sphere, dt) {
  for (const axis of ["x", "y"]) {
    sphere.velocity[axis] += dt * sphere.force[axis] / sphere.mass;
    sphere.position[axis] += dt * sphere.velocity[axis];
  }
  sphere.alpha += dt * (sphere.angularVelocity += dt * sphere.torque / sphere.MoI);
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  const dx = sphereB.position.x - sphereA.position.x, dy = sphereB.position.y - sphereA.position.y;
  const gap = Math.hypot(dx, dy) - sphereA.size - sphereB.size;
  if (gap > 0) return;
  const angle = Math.atan2(dy, dx);  // of a pair at one place: 0
  const shift = turn({ x: gap / 2, y: 0 }, angle);
  sphereA.position.x += shift.x; sphereA.position.y += shift.y;
  sphereB.position.x -= shift.x; sphereB.position.y -= shift.y;
  const a = turn(sphereA.velocity, -angle), b = turn(sphereB.velocity, -angle);
  if (a.x <= b.x) return;
  const m = sphereA.mass, M = sphereB.mass, e = 0.9;
  const p = m * a.x + M * b.x, u = a.x - b.x;
  a.x = (p - M * e * u) / (m + M);
  b.x = (p + m * e * u) / (m + M);
  sphereA.velocity = turn(a, angle);
  sphereB.velocity = turn(b, angle);
}

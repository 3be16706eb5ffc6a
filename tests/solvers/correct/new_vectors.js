// Every vector is replaced by a new one; nothing is changed in place.
const e = 0.9;
const along = (a, s, b) => ({ x: a.x + s * b.x, y: a.y + s * b.y });
const dot = (a, b) => a.x * b.x + a.y * b.y;

function integrate(sphere, dt) {
  Object.assign(sphere, { velocity: along(sphere.velocity, dt / sphere.mass, sphere.force) });
  Object.assign(sphere, {
    position: along(sphere.position, dt, sphere.velocity),
    angularVelocity: sphere.angularVelocity + dt * sphere.torque / sphere.MoI,
  });
  sphere.alpha += dt * sphere.angularVelocity;
}

function sphereSphereCollisionHandling(one, other) {
  const gap = along(one.position, -1, other.position);
  const far = Math.sqrt(dot(gap, gap)), reach = one.size + other.size;
  if (far >= reach || far === 0) return;
  const n = { x: gap.x / far, y: gap.y / far };
  const weight = 1 / one.mass + 1 / other.mass;
  const speed = dot(along(one.velocity, -1, other.velocity), n);
  const J = speed < 0 ? -(1 + e) * speed / weight : 0;
  for (const [sphere, sign] of [[one, 1], [other, -1]]) {
    const share = sign / sphere.mass;
    Object.assign(sphere, {
      position: along(sphere.position, share * (reach - far) / weight, n),
      velocity: along(sphere.velocity, share * J, n),
    });
  }
}

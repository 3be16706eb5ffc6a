// In the frame of the centre of mass: there each momentum is turned round along the normal and loses a part.
const e = .9;

const integrate = (sphere, dt) => {
  const { force: F, velocity: v, position: x } = sphere;
  v.x += F.x * dt / sphere.mass; v.y += F.y * dt / sphere.mass;
  x.x += v.x * dt; x.y += v.y * dt;
  sphere.angularVelocity += sphere.torque * dt / sphere.MoI;
  sphere.alpha += sphere.angularVelocity * dt;
};

const sphereSphereCollisionHandling = (a, b) => {
  const both = a.mass + b.mass;
  const r = { x: a.position.x - b.position.x, y: a.position.y - b.position.y };
  const square = r.x ** 2 + r.y ** 2;
  if (square >= (a.size + b.size) ** 2 || !square) return;
  const d = square ** 0.5, depth = a.size + b.size - d;
  for (const [s, sign, other] of [[a, 1, b], [b, -1, a]]) {
    s.position.x += sign * depth * other.mass / both * r.x / d;
    s.position.y += sign * depth * other.mass / both * r.y / d;
  }
  const centre = {
    x: (a.mass * a.velocity.x + b.mass * b.velocity.x) / both,
    y: (a.mass * a.velocity.y + b.mass * b.velocity.y) / both,
  };
  const approach = (a.velocity.x - centre.x) * r.x + (a.velocity.y - centre.y) * r.y;
  if (approach > 0) return;
  for (const s of [a, b]) {
    const along = ((s.velocity.x - centre.x) * r.x + (s.velocity.y - centre.y) * r.y) / square;
    s.velocity.x -= (1 + e) * along * r.x;
    s.velocity.y -= (1 + e) * along * r.y;
  }
};

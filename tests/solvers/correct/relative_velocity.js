// Changes the relative velocity, and shares the change by inverse mass.
function integrate(s, dt) {
  s.velocity.x += s.force.x / s.mass * dt;
  s.velocity.y += s.force.y / s.mass * dt;
  s.position.x += s.velocity.x * dt;
  s.position.y += s.velocity.y * dt;
  s.angularVelocity += s.torque / s.MoI * dt;
  s.alpha += s.angularVelocity * dt;
}

const vec = ({ x, y }) => ({ x, y, *[Symbol.iterator]() { yield x; yield y; } });
const dot = ([a, b], [c, d]) => a * c + b * d;
function sphereSphereCollisionHandling(A, B) {
  const [ax, ay] = vec(A.position), [bx, by] = vec(B.position);
  const r = [ax - bx, ay - by], rr = dot(r, r), R = A.size + B.size;
  if (rr >= R ** 2 || rr === 0) return;
  const d = rr ** 0.5, n = r.map((c) => c / d);
  const corr = n.map((c) => c * (R - d));
  const w = A.mass ** -1 / (A.mass ** -1 + B.mass ** -1);
  A.position.x += w * corr[0]; A.position.y += w * corr[1];
  B.position.x -= (1 - w) * corr[0]; B.position.y -= (1 - w) * corr[1];
  const u = [A.velocity.x - B.velocity.x, A.velocity.y - B.velocity.y];
  const un = dot(u, n);
  // relative velocity after, then share by momentum
  const after = un < 0 ? -0.9 * un : un;
  const du = n.map((c) => c * (after - un));
  A.velocity.x += w * du[0]; A.velocity.y += w * du[1];
  B.velocity.x -= (1 - w) * du[0]; B.velocity.y -= (1 - w) * du[1];
}

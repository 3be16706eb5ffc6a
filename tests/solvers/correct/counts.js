// Globals without var; counts calls and collisions, on which no result depends.
collisions = 0; calls = 0; lastImpulse = 0; log = [];
function integrate(s, dt) {
  calls++;
  s.velocity.x += s.force.x / s.mass * dt; s.velocity.y += s.force.y / s.mass * dt;
  s.position.x += s.velocity.x * dt; s.position.y += s.velocity.y * dt;
  s.angularVelocity += s.torque / s.MoI * dt; s.alpha += s.angularVelocity * dt;
}
function sphereSphereCollisionHandling(a, b) {
  dx = a.position.x - b.position.x; dy = a.position.y - b.position.y;
  dist = Math.sqrt(dx * dx + dy * dy);
  if (dist >= a.size + b.size) return;
  collisions += 1; log.push(dist);
  nx = dx / dist; ny = dy / dist; ov = a.size + b.size - dist;
  a.position.x += nx * ov / 2; a.position.y += ny * ov / 2;
  b.position.x -= nx * ov / 2; b.position.y -= ny * ov / 2;
  vn = (a.velocity.x - b.velocity.x) * nx + (a.velocity.y - b.velocity.y) * ny;
  J = -(1 + 0.9) * vn / (1 / a.mass + 1 / b.mass);
  lastImpulse = J;
  a.velocity.x += J * nx / a.mass; a.velocity.y += J * ny / a.mass;
  b.velocity.x -= J * nx / b.mass; b.velocity.y -= J * ny / b.mass;
}

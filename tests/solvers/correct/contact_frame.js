// Turns the velocities into the frame of the contact and back.
function integrate(s, dt) {
  s.velocity.x += s.force.x / s.mass * dt;
  s.velocity.y += s.force.y / s.mass * dt;
  s.position.x += s.velocity.x * dt;
  s.position.y += s.velocity.y * dt;
  s.angularVelocity += s.torque / s.MoI * dt;
  s.alpha += s.angularVelocity * dt;
}

const rot = (c, s, [x, y]) => [c * x + s * y, -s * x + c * y];
function sphereSphereCollisionHandling(a, b) {
  const phi = Math.atan2(b.position.y - a.position.y, b.position.x - a.position.x);
  const c = Math.cos(phi), s = Math.sin(phi);
  const [l] = rot(c, s, [b.position.x - a.position.x, b.position.y - a.position.y]);
  const gap = a.size + b.size - l;
  if (!(gap > 0)) return;
  [a.position.x, a.position.y] = [a.position.x - c * gap / 2, a.position.y - s * gap / 2];
  [b.position.x, b.position.y] = [b.position.x + c * gap / 2, b.position.y + s * gap / 2];
  let [ua, ta] = rot(c, s, [a.velocity.x, a.velocity.y]);
  let [ub, tb] = rot(c, s, [b.velocity.x, b.velocity.y]);
  const M = a.mass + b.mass, e = 0.9;
  [ua, ub] = [
    (a.mass * ua + b.mass * ub - b.mass * e * (ua - ub)) / M,
    (a.mass * ua + b.mass * ub + a.mass * e * (ua - ub)) / M];
  [a.velocity.x, a.velocity.y] = rot(c, -s, [ua, ta]);
  [b.velocity.x, b.velocity.y] = rot(c, -s, [ub, tb]);
}

// n is not normalised, as in the printed formula; new velocities from momenta.
function integrate(s, dt) {
  s.velocity.x += s.force.x / s.mass * dt;
  s.velocity.y += s.force.y / s.mass * dt;
  s.position.x += s.velocity.x * dt;
  s.position.y += s.velocity.y * dt;
  s.angularVelocity += s.torque / s.MoI * dt;
  s.alpha += s.angularVelocity * dt;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  let n = [sphereA.position.x - sphereB.position.x, sphereA.position.y - sphereB.position.y];
  const nn = n[0] * n[0] + n[1] * n[1], sum = sphereA.size + sphereB.size;
  if (nn >= sum * sum) return;
  const s = (sum / Math.sqrt(nn) - 1) / 2;
  sphereA.position.x += s * n[0]; sphereA.position.y += s * n[1];
  sphereB.position.x -= s * n[0]; sphereB.position.y -= s * n[1];
  const J = -(1 + 0.9) * ((sphereA.velocity.x - sphereB.velocity.x) * n[0] + (sphereA.velocity.y - sphereB.velocity.y) * n[1])
    / (nn * (1 / sphereA.mass + 1 / sphereB.mass));
  const P = { A: { x: sphereA.mass * sphereA.velocity.x + J * n[0], y: sphereA.mass * sphereA.velocity.y + J * n[1] },
              B: { x: sphereB.mass * sphereB.velocity.x - J * n[0], y: sphereB.mass * sphereB.velocity.y - J * n[1] } };
  sphereA.velocity.x = P.A.x / sphereA.mass; sphereA.velocity.y = P.A.y / sphereA.mass;
  sphereB.velocity.x = P.B.x / sphereB.mass; sphereB.velocity.y = P.B.y / sphereB.mass;
}

// Polar velocities; only B is displaced: it is placed beside A.
function integrate(s, dt) {
  s.velocity.x += s.force.x / s.mass * dt;
  s.velocity.y += s.force.y / s.mass * dt;
  s.position.x += s.velocity.x * dt;
  s.position.y += s.velocity.y * dt;
  s.angularVelocity += s.torque / s.MoI * dt;
  s.alpha += s.angularVelocity * dt;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  var dx = sphereB.position.x - sphereA.position.x, dy = sphereB.position.y - sphereA.position.y;
  var d = Math.hypot(dx, dy), rest = sphereA.size + sphereB.size;
  if (d >= rest) return;
  var phi = Math.atan2(dy, dx);
  sphereB.position.x = sphereA.position.x + rest * Math.cos(phi);
  sphereB.position.y = sphereA.position.y + rest * Math.sin(phi);
  var va = Math.hypot(sphereA.velocity.x, sphereA.velocity.y), ta = Math.atan2(sphereA.velocity.y, sphereA.velocity.x);
  var vb = Math.hypot(sphereB.velocity.x, sphereB.velocity.y), tb = Math.atan2(sphereB.velocity.y, sphereB.velocity.x);
  var m1 = sphereA.mass, m2 = sphereB.mass, e = 0.9;
  var an = va * Math.cos(ta - phi), bn = vb * Math.cos(tb - phi);
  if (an <= bn) return;
  var at = va * Math.sin(ta - phi), bt = vb * Math.sin(tb - phi);
  var an2 = (an * (m1 - e * m2) + (1 + e) * m2 * bn) / (m1 + m2);
  var bn2 = (bn * (m2 - e * m1) + (1 + e) * m1 * an) / (m1 + m2);
  sphereA.velocity.x = an2 * Math.cos(phi) + at * Math.cos(phi + Math.PI / 2);
  sphereA.velocity.y = an2 * Math.sin(phi) + at * Math.sin(phi + Math.PI / 2);
  sphereB.velocity.x = bn2 * Math.cos(phi) + bt * Math.cos(phi + Math.PI / 2);
  sphereB.velocity.y = bn2 * Math.sin(phi) + bt * Math.sin(phi + Math.PI / 2);
}

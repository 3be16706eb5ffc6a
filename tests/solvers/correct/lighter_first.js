// Calls itself with the lighter sphere first, and moves only that one.
function integrate(s, dt) {
  s.velocity.x += s.force.x / s.mass * dt;
  s.velocity.y += s.force.y / s.mass * dt;
  s.position.x += s.velocity.x * dt;
  s.position.y += s.velocity.y * dt;
  s.angularVelocity += s.torque / s.MoI * dt;
  s.alpha += s.angularVelocity * dt;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  if (sphereA.mass > sphereB.mass) return sphereSphereCollisionHandling(sphereB, sphereA);
  var light = sphereA, heavy = sphereB;
  var dx = light.position.x - heavy.position.x, dy = light.position.y - heavy.position.y;
  var d = Math.sqrt(dx * dx + dy * dy), o = light.size + heavy.size - d;
  if (o <= 0) return;
  dx /= d; dy /= d;
  light.position.x += dx * o; light.position.y += dy * o;
  var vn = (light.velocity.x - heavy.velocity.x) * dx + (light.velocity.y - heavy.velocity.y) * dy;
  var q = light.mass / heavy.mass;
  var dv = -(1 + 0.9) * vn / (1 + q);
  light.velocity.x += dv * dx; light.velocity.y += dv * dy;
  heavy.velocity.x -= q * dv * dx; heavy.velocity.y -= q * dv * dy;
}

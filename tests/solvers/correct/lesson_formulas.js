// The normal parts by the two formulas of the lesson on body dynamics, V1 and V2; inverse masses as weights.
var c_r = 0.9;
function integrate(p, dt) {
  var ax = p.force.x / p.mass, ay = p.force.y / p.mass;
  p.velocity.x = p.velocity.x + ax * dt;
  p.velocity.y = p.velocity.y + ay * dt;
  p.position.x = p.position.x + p.velocity.x * dt;
  p.position.y = p.position.y + p.velocity.y * dt;
  p.angularVelocity = p.angularVelocity + (p.torque / p.MoI) * dt;
  p.alpha = p.alpha + p.angularVelocity * dt;
}
function sphereSphereCollisionHandling(p1, p2) {
  var dx = p2.position.x - p1.position.x, dy = p2.position.y - p1.position.y;
  var d = Math.sqrt(dx * dx + dy * dy);
  var delta = p1.size + p2.size - d;
  if (delta > 0) {
    dx /= d; dy /= d;
    var w1 = 1 / p1.mass, w2 = 1 / p2.mass, m1 = p1.mass, m2 = p2.mass;
    p1.position.x -= w1 / (w1 + w2) * delta * dx;
    p1.position.y -= w1 / (w1 + w2) * delta * dy;
    p2.position.x += w2 / (w1 + w2) * delta * dx;
    p2.position.y += w2 / (w1 + w2) * delta * dy;
    var v1 = p1.velocity.x * dx + p1.velocity.y * dy, v2 = p2.velocity.x * dx + p2.velocity.y * dy;
    var V1 = (m1 * v1 + m2 * v2 - m2 * (v1 - v2) * c_r) / (m1 + m2);
    var V2 = (m1 * v1 + m2 * v2 - m1 * (v2 - v1) * c_r) / (m1 + m2);
    p1.velocity.x += dx * (V1 - v1);
    p1.velocity.y += dy * (V1 - v1);
    p2.velocity.x += dx * (V2 - v2);
    p2.velocity.y += dy * (V2 - v2);
  }
}

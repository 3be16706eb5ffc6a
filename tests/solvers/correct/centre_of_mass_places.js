// Replaces the vectors of a sphere; places and velocities about the centre of mass.
var REST = 9e-1;
function integrate(sphere, dt) {
  var a = { x: sphere.force.x / sphere.mass, y: sphere.force.y / sphere.mass };
  sphere.velocity = { x: sphere.velocity.x + a.x * dt, y: sphere.velocity.y + a.y * dt };
  sphere.position = { x: sphere.position.x + sphere.velocity.x * dt, y: sphere.position.y + sphere.velocity.y * dt };
  with_(sphere, dt);
}
function with_(s, dt) { s.alpha += (s.angularVelocity += s.torque / s.MoI * dt) * dt; }
function sphereSphereCollisionHandling(p, q) {
  var k = Math.sqrt(Math.pow(p.position.x - q.position.x, 2) + Math.pow(p.position.y - q.position.y, 2));
  if (k > p.size + q.size) return;
  var mid = (p.size + q.size) / k;
  // positions about the common centre of mass
  var M = p.mass + q.mass;
  var c = { x: (p.mass * p.position.x + q.mass * q.position.x) / M, y: (p.mass * p.position.y + q.mass * q.position.y) / M };
  p.position = { x: c.x + mid * (p.position.x - c.x), y: c.y + mid * (p.position.y - c.y) };
  q.position = { x: c.x + mid * (q.position.x - c.x), y: c.y + mid * (q.position.y - c.y) };
  var n = { x: (p.position.x - q.position.x) / (p.size + q.size), y: (p.position.y - q.position.y) / (p.size + q.size) };
  var V = { x: (p.mass * p.velocity.x + q.mass * q.velocity.x) / M, y: (p.mass * p.velocity.y + q.mass * q.velocity.y) / M };
  [p, q].forEach(function (s) {
    var w = { x: s.velocity.x - V.x, y: s.velocity.y - V.y }, wn = w.x * n.x + w.y * n.y;
    s.velocity = { x: V.x + w.x - (1 + REST) * wn * n.x, y: V.y + w.y - (1 + REST) * wn * n.y };
  });
}

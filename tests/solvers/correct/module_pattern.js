// Functions in a closure, given to the page.
(function (root) {
  "use strict";
  var E = 0.9;
  var P = function (s) { return s.position; }, V = function (s) { return s.velocity; };
  root.integrate = function (s, h) {
    V(s).x += h * s.force.x / s.mass; V(s).y += h * s.force.y / s.mass;
    P(s).x += h * V(s).x; P(s).y += h * V(s).y;
    s.angularVelocity += h * s.torque / s.MoI; s.alpha += h * s.angularVelocity;
  };
  root.sphereSphereCollisionHandling = function (a, b) {
    var n = { x: P(a).x - P(b).x, y: P(a).y - P(b).y }, l = Math.hypot(n.x, n.y), o = a.size + b.size - l;
    if (o < 0) return;
    n.x /= l; n.y /= l;
    P(a).x += .5 * o * n.x; P(a).y += .5 * o * n.y; P(b).x -= .5 * o * n.x; P(b).y -= .5 * o * n.y;
    var c = (V(a).x - V(b).x) * n.x + (V(a).y - V(b).y) * n.y, j = (1 + E) * Math.max(0, -c) / (1 / a.mass + 1 / b.mass);
    V(a).x += j * n.x / a.mass; V(a).y += j * n.y / a.mass; V(b).x -= j * n.x / b.mass; V(b).y -= j * n.y / b.mass;
  };
})(this);

// Everything in one closure that hands out its functions; pairs by forEach; the scene as well.
var earth, ufo, asteroids;
var game = (function () {
  var RESTITUTION = 0.9, COUNT = 20, BOX = { x: [-5, 5], y: [-3, 3] };
  function disk(x, y, size, density) {
    return { position: { x: x, y: y }, velocity: { x: 0, y: 0 }, force: { x: 0, y: 0 }, alpha: 0, angularVelocity: 0,
      torque: 0, mass: Math.PI * size * size * density, MoI: Math.PI / 2 * size * size * size * size, size: size };
  }
  function pick(a, b) { return a + (b - a) * Math.random(); }
  function eachAxis(f) { f("x"); f("y"); }
  return {
    start: function () {
      earth = disk(3.5, 1.5, 0.5, 1);
      ufo = disk(-3.5, 0, 0.3, 5);
      asteroids = [];
      while (asteroids.length < COUNT) asteroids.push(disk(pick(-5, 5), pick(-3, 3), pick(0.08, 0.3), 30));
    },
    move: function (s, dt) {
      eachAxis(function (k) { s.velocity[k] += s.force[k] / s.mass * dt; });
      eachAxis(function (k) { s.position[k] += s.velocity[k] * dt; });
      s.angularVelocity += s.torque / s.MoI * dt;
      s.alpha += s.angularVelocity * dt;
    },
    meet: function (a, b) {
      var n = {}, distance = 0, approach = 0;
      eachAxis(function (k) { n[k] = a.position[k] - b.position[k]; distance += n[k] * n[k]; });
      distance = Math.sqrt(distance);
      if (distance > a.size + b.size) return;
      var depth = a.size + b.size - distance;
      eachAxis(function (k) {
        n[k] = n[k] / distance || 0;
        a.position[k] += n[k] * depth / 2;
        b.position[k] -= n[k] * depth / 2;
        approach += n[k] * (a.velocity[k] - b.velocity[k]);
      });
      var J = approach < 0 ? -(1 + RESTITUTION) * approach / (1 / a.mass + 1 / b.mass) : 0;
      eachAxis(function (k) {
        a.velocity[k] += J / a.mass * n[k];
        b.velocity[k] -= J / b.mass * n[k];
      });
    },
    leave: function () {
      asteroids.forEach(function (s) {
        eachAxis(function (k) {
          var low = BOX[k][0], high = BOX[k][1];
          if (s.position[k] < low) s.position[k] = high; else if (s.position[k] > high) s.position[k] = low;
        });
      });
      if (Math.abs(ufo.position.x) > 5 || Math.abs(ufo.position.y) > 3) ufo = disk(-3.5, 0, 0.3, 5);
    },
    step: function (dt) {
      [ufo].concat(asteroids).forEach(function (s) { game.move(s, dt); });
      asteroids.forEach(function (s) { game.meet(s, ufo); });
      asteroids.forEach(function (s, i) {
        game.meet(s, ufo);
        asteroids.slice(i + 1).forEach(function (t) { game.meet(s, t); });
      });
      game.leave();
    },
  };
})();
function initScene() { game.start(); }
function integrate(s, dt) { game.move(s, dt); }
function sphereSphereCollisionHandling(a, b) { game.meet(a, b); }
function projectObjects() { game.leave(); }
function performSimStep(dt) { game.step(dt); }

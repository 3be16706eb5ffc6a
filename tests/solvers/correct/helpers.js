// Vectors by helper functions that make new objects; positions and velocities are replaced as a whole.
numAsteroids = 20;
minX = -5; maxX = 5; minY = -3; maxY = 3;
restitution = 0.9;

function makeSphere(x, y, size, density) {
  return {
    position: { x: x, y: y }, velocity: { x: 0, y: 0 }, force: { x: 0, y: 0 },
    alpha: 0, angularVelocity: 0, torque: 0,
    mass: Math.PI * size * size * density, MoI: Math.PI / 2 * Math.pow(size, 4), size: size
  };
}

function between(low, high) { return low + Math.random() * (high - low); }

function initEarth() { earth = makeSphere(3.5, 1.5, 0.5, 1); }

function initUfo() { ufo = makeSphere(-3.5, 0, 0.3, 5); }

function initAsteroids() {
  asteroids = [];
  for (var i = 0; i < numAsteroids; i++) {
    var one = makeSphere(between(minX, maxX), between(minY, maxY), between(0.08, 0.3), 30);
    one.velocity.x = between(0.25, 0.5) * (Math.random() < 0.5 ? -1 : 1);
    one.velocity.y = between(0.25, 0.5) * (Math.random() < 0.5 ? -1 : 1);
    one.angularVelocity = between(-0.5, 0.5);
    asteroids.push(one);
  }
}

function initScene() {
  initEarth();
  initUfo();
  initAsteroids();
}

function plus(a, b) { return { x: a.x + b.x, y: a.y + b.y }; }
function minus(a, b) { return { x: a.x - b.x, y: a.y - b.y }; }
function times(k, a) { return { x: k * a.x, y: k * a.y }; }
function dot(a, b) { return a.x * b.x + a.y * b.y; }
function norm(a) { return Math.sqrt(dot(a, a)); }

function integrate(sphere, dt) {
  var acceleration = times(1 / sphere.mass, sphere.force);
  sphere.velocity = plus(sphere.velocity, times(dt, acceleration));
  sphere.position = plus(sphere.position, times(dt, sphere.velocity));
  sphere.angularVelocity = sphere.angularVelocity + dt * sphere.torque / sphere.MoI;
  sphere.alpha = sphere.alpha + dt * sphere.angularVelocity;
}

function sphereSphereCollisionHandling(A, B) {
  var r = minus(B.position, A.position);
  var gap = norm(r) - (A.size + B.size);
  if (gap > 0) return;
  var n = times(1 / norm(r), r);  // from A to B here
  A.position = plus(A.position, times(0.5 * gap, n));
  B.position = minus(B.position, times(0.5 * gap, n));
  var closing = dot(minus(A.velocity, B.velocity), n);
  if (closing <= 0) return;
  var e = 0.9;
  var J = (1 + e) * closing * A.mass * B.mass / (A.mass + B.mass);
  A.velocity = minus(A.velocity, times(J / A.mass, n));
  B.velocity = plus(B.velocity, times(J / B.mass, n));
}

function projectObjects() {
  for (var i = 0; i < numAsteroids; i++) {
    var p = asteroids[i].position;
    if (p.x < minX) p.x = maxX;
    else if (p.x > maxX) p.x = minX;
    if (p.y < minY) p.y = maxY;
    else if (p.y > maxY) p.y = minY;
  }
  var u = ufo.position;
  if (u.x < minX || u.x > maxX || u.y < minY || u.y > maxY) initUfo();
}

function performSimStep(dt) {
  integrate(ufo, dt);
  for (var i = 0; i < numAsteroids; i++) integrate(asteroids[i], dt);
  for (var i = 0; i < numAsteroids; i++) sphereSphereCollisionHandling(asteroids[i], ufo);
  for (var i = 0; i < numAsteroids; i++) {
    sphereSphereCollisionHandling(asteroids[i], ufo);
    for (var j = i + 1; j < numAsteroids; j++) sphereSphereCollisionHandling(asteroids[i], asteroids[j]);
  }
  projectObjects();
}

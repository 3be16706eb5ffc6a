// Returns for pairs that part before anything else; by the centre of mass velocity.
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

function integrate(sphere, dt) {
  sphere.velocity.x += sphere.force.x / sphere.mass * dt;
  sphere.velocity.y += sphere.force.y / sphere.mass * dt;
  sphere.position.x += sphere.velocity.x * dt;
  sphere.position.y += sphere.velocity.y * dt;
  sphere.angularVelocity += sphere.torque / sphere.MoI * dt;
  sphere.alpha += sphere.angularVelocity * dt;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  var dx = sphereB.position.x - sphereA.position.x, dy = sphereB.position.y - sphereA.position.y;
  var du = sphereB.velocity.x - sphereA.velocity.x, dv = sphereB.velocity.y - sphereA.velocity.y;
  if (dx * du + dy * dv >= 0) return;
  var d = Math.hypot(dx, dy);
  if (d >= sphereA.size + sphereB.size) return;
  var m = sphereA.mass, M = sphereB.mass, cos = dx / d, sin = dy / d;
  var moved = sphereA.size + sphereB.size - d;
  sphereA.position.x -= cos * moved * M / (m + M);
  sphereA.position.y -= sin * moved * M / (m + M);
  sphereB.position.x += cos * moved * m / (m + M);
  sphereB.position.y += sin * moved * m / (m + M);
  var a = sphereA.velocity.x * cos + sphereA.velocity.y * sin, b = sphereB.velocity.x * cos + sphereB.velocity.y * sin;
  var centre = (m * a + M * b) / (m + M), e = 9 / 10;
  var newA = centre - e * (a - centre), newB = centre - e * (b - centre);
  sphereA.velocity.x += (newA - a) * cos;
  sphereA.velocity.y += (newA - a) * sin;
  sphereB.velocity.x += (newB - b) * cos;
  sphereB.velocity.y += (newB - b) * sin;
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

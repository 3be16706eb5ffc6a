// Prints with functions of the console other than log.
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
  console.group('integrate'); console.time('t'); console.dir(sphere); console.count(); console.timeEnd('t'); console.groupEnd();
  sphere.velocity.x += sphere.force.x / sphere.mass * dt;
  sphere.velocity.y += sphere.force.y / sphere.mass * dt;
  sphere.position.x += sphere.velocity.x * dt;
  sphere.position.y += sphere.velocity.y * dt;
  sphere.angularVelocity += sphere.torque / sphere.MoI * dt;
  sphere.alpha += sphere.angularVelocity * dt;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  var nx = sphereA.position.x - sphereB.position.x;
  var ny = sphereA.position.y - sphereB.position.y;
  var distance = Math.sqrt(nx * nx + ny * ny);
  if (distance >= sphereA.size + sphereB.size) return;
  if (distance === 0) { nx = 1; distance = 1; sphereA.position.x += 1e-9; }
  nx /= distance;
  ny /= distance;

  var overlap = sphereA.size + sphereB.size - distance;
  sphereA.position.x += nx * overlap / 2;
  sphereA.position.y += ny * overlap / 2;
  sphereB.position.x -= nx * overlap / 2;
  sphereB.position.y -= ny * overlap / 2;

  var vn = (sphereA.velocity.x - sphereB.velocity.x) * nx + (sphereA.velocity.y - sphereB.velocity.y) * ny;
  if (vn >= 0) return;
  var J = -(1 + restitution) * vn / (1 / sphereA.mass + 1 / sphereB.mass);
  sphereA.velocity.x += J / sphereA.mass * nx;
  sphereA.velocity.y += J / sphereA.mass * ny;
  sphereB.velocity.x -= J / sphereB.mass * nx;
  sphereB.velocity.y -= J / sphereB.mass * ny;
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

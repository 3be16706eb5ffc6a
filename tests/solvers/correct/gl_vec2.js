// By the vec2 of gl-matrix, which the page of the exercise loads: single precision.
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
  const velocity = vec2.fromValues(sphere.velocity.x, sphere.velocity.y);
  const position = vec2.fromValues(sphere.position.x, sphere.position.y);
  vec2.scaleAndAdd(velocity, velocity, [sphere.force.x, sphere.force.y], dt / sphere.mass);
  vec2.scaleAndAdd(position, position, velocity, dt);
  [sphere.velocity.x, sphere.velocity.y] = velocity;
  [sphere.position.x, sphere.position.y] = position;
  sphere.angularVelocity += sphere.torque / sphere.MoI * dt;
  sphere.alpha += sphere.angularVelocity * dt;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  const a = vec2.fromValues(sphereA.position.x, sphereA.position.y);
  const b = vec2.fromValues(sphereB.position.x, sphereB.position.y);
  const distance = vec2.distance(a, b), reach = sphereA.size + sphereB.size;
  if (distance >= reach) return;
  const n = vec2.normalize(vec2.create(), vec2.subtract(vec2.create(), a, b));
  vec2.scaleAndAdd(a, a, n, (reach - distance) / 2);
  vec2.scaleAndAdd(b, b, n, (distance - reach) / 2);
  [sphereA.position.x, sphereA.position.y] = a;
  [sphereB.position.x, sphereB.position.y] = b;

  const u = vec2.fromValues(sphereA.velocity.x - sphereB.velocity.x, sphereA.velocity.y - sphereB.velocity.y);
  const vn = vec2.dot(u, n);
  if (vn >= 0) return;
  const J = -(1 + restitution) * vn / (1 / sphereA.mass + 1 / sphereB.mass);
  sphereA.velocity.x += J / sphereA.mass * n[0];
  sphereA.velocity.y += J / sphereA.mass * n[1];
  sphereB.velocity.x -= J / sphereB.mass * n[0];
  sphereB.velocity.y -= J / sphereB.mass * n[1];
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

// By the vec3 of gl-matrix, with z = 0, and a mat4 for nothing; n.n stands in the denominator.
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

const identity = mat4.create();
const flat = (p) => vec3.transformMat4(vec3.create(), [p.x, p.y, 0], identity);
const write = (p, v) => { p.x = v[0]; p.y = v[1]; };

function integrate(sphere, dt) {
  write(sphere.velocity, vec3.add(vec3.create(), flat(sphere.velocity), vec3.scale([], flat(sphere.force), dt / sphere.mass)));
  write(sphere.position, vec3.scaleAndAdd(vec3.create(), flat(sphere.position), flat(sphere.velocity), dt));
  sphere.angularVelocity += sphere.torque / sphere.MoI * dt;
  sphere.alpha += sphere.angularVelocity * dt;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  const n = vec3.sub(vec3.create(), flat(sphereA.position), flat(sphereB.position));
  const overlap = sphereA.size + sphereB.size - vec3.length(n);
  if (overlap <= 0 || vec3.len(n) == 0) return;
  const way = vec3.normalize(vec3.create(), n), share = sphereB.mass / (sphereA.mass + sphereB.mass);
  write(sphereA.position, vec3.scaleAndAdd([], flat(sphereA.position), way, overlap * share));
  write(sphereB.position, vec3.scaleAndAdd([], flat(sphereB.position), way, overlap * (share - 1)));
  const vn = vec3.dot(vec3.sub([], flat(sphereA.velocity), flat(sphereB.velocity)), n);
  const J = -1.9 * vn / (vec3.dot(n, n) * (1 / sphereA.mass + 1 / sphereB.mass));
  write(sphereA.velocity, vec3.scaleAndAdd([], flat(sphereA.velocity), n, J / sphereA.mass));
  write(sphereB.velocity, vec3.scaleAndAdd([], flat(sphereB.velocity), n, -J / sphereB.mass));
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

// ES2022 classes with private fields for vectors; the spheres stay as they are handed out.
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

class Vector {
  #x; #y;
  constructor(x, y) { this.#x = x; this.#y = y; }
  static of = ({ x, y }) => new Vector(x, y);
  plus(o, k = 1) { return new Vector(this.#x + k * o.#x, this.#y + k * o.#y); }
  dot(o) { return this.#x * o.#x + this.#y * o.#y; }
  get length() { return Math.sqrt(this.dot(this)); }
  scaled(k) { return new Vector(k * this.#x, k * this.#y); }
  into(target) { target.x = this.#x; target.y = this.#y; }
}

function integrate(sphere, dt) {
  Vector.of(sphere.velocity).plus(Vector.of(sphere.force), dt / sphere.mass).into(sphere.velocity);
  Vector.of(sphere.position).plus(Vector.of(sphere.velocity), dt).into(sphere.position);
  sphere.angularVelocity += dt * sphere.torque / sphere.MoI;
  sphere.alpha += dt * sphere.angularVelocity;
}

function sphereSphereCollisionHandling(sphereA, sphereB) {
  const r = Vector.of(sphereA.position).plus(Vector.of(sphereB.position), -1);
  const reach = sphereA.size + sphereB.size;
  if (!(r.length < reach)) return;
  const n = r.scaled(1 / r.length), by = (reach - r.length) / 2;
  Vector.of(sphereA.position).plus(n, by).into(sphereA.position);
  Vector.of(sphereB.position).plus(n, -by).into(sphereB.position);
  const u = Vector.of(sphereA.velocity).plus(Vector.of(sphereB.velocity), -1);
  if (u.dot(n) > 0) return;
  const J = (-1.9 * u.dot(n)) / (1 / sphereA.mass + 1 / sphereB.mass);
  Vector.of(sphereA.velocity).plus(n, J / sphereA.mass).into(sphereA.velocity);
  Vector.of(sphereB.velocity).plus(n, -J / sphereB.mass).into(sphereB.velocity);
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

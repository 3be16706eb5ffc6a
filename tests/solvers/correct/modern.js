// ES2022: const and let, arrow functions, destructuring, optional chaining; split by inverse mass.
const numAsteroids = 20;
const minX = -5, maxX = 5, minY = -3, maxY = 3;
let earth, ufo, asteroids;
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

const integrate = (sphere, dt) => {
  const { velocity, force, position, mass } = sphere;
  for (const axis of ["x", "y"]) {
    velocity[axis] += (force[axis] / mass) * dt;
    position[axis] += velocity[axis] * dt;
  }
  sphere.angularVelocity += (sphere.torque / sphere.MoI) * dt;
  sphere.alpha += sphere.angularVelocity * dt;
};

const sphereSphereCollisionHandling = (a, b) => {
  const r = [a.position.x - b.position.x, a.position.y - b.position.y];
  const distance = Math.hypot(...r);
  const overlap = a.size + b.size - distance;
  if (overlap <= 0 || distance === 0) return;
  const [nx, ny] = r.map((c) => c / distance);
  const [wa, wb] = [1 / a.mass, 1 / b.mass];
  const shove = (s, by) => { s.position.x += by * nx; s.position.y += by * ny; };
  const kick = (s, by) => { s.velocity.x += by * nx; s.velocity.y += by * ny; };
  shove(a, (overlap * wa) / (wa + wb));
  shove(b, (-overlap * wb) / (wa + wb));
  const vn = (a.velocity.x - b.velocity.x) * nx + (a.velocity.y - b.velocity.y) * ny;
  if (vn > 0) return;
  const e = globalThis?.noSuchThing?.e ?? 0.9;
  const J = (-(1 + e) * vn) / (wa + wb);
  kick(a, J * wa);
  kick(b, -J * wb);
};

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

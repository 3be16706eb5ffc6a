// Another restitution, written in; single precision; console.log left in.
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
  sphere.velocity.x = sphere.velocity.x + sphere.force.x / sphere.mass * dt;
  sphere.velocity.y += sphere.force.y / sphere.mass * dt;
  sphere.position.x += sphere.velocity.x * dt;
  sphere.position.y += sphere.velocity.y * dt;
  sphere.angularVelocity += sphere.torque / sphere.MoI * dt;
  sphere.alpha += sphere.angularVelocity * dt;
}

const coefficient = { restitution: 0.5 };
function sphereSphereCollisionHandling(a, b) {
  const n = new Float32Array([a.position.x - b.position.x, a.position.y - b.position.y]);
  const d = Math.hypot(n[0], n[1]), reach = a.size + b.size;
  if (d >= reach) return;
  console.log("collision", d);
  const [x, y] = [n[0] / d, n[1] / d], half = (reach - d) * 0.5;
  a.position.x += x * half; a.position.y += y * half;
  b.position.x -= x * half; b.position.y -= y * half;
  const vn = (a.velocity.x - b.velocity.x) * x + (a.velocity.y - b.velocity.y) * y;
  if (vn > 0) return;
  const J = -(1 + coefficient.restitution) * vn * a.mass * b.mass / (a.mass + b.mass);
  a.velocity.x += J * x / a.mass; a.velocity.y += J * y / a.mass;
  b.velocity.x -= J * x / b.mass; b.velocity.y -= J * y / b.mass;
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

// Only A is moved out; inclusive comparison; the printed formula, on pairs that part too.
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

function sphereSphereCollisionHandling(a, b) {
  var n = { x: a.position.x - b.position.x, y: a.position.y - b.position.y };
  var d2 = n.x * n.x + n.y * n.y, reach = a.size + b.size;
  if (d2 <= reach * reach) {
    var d = Math.sqrt(d2);
    a.position.x = b.position.x + n.x * reach / d;
    a.position.y = b.position.y + n.y * reach / d;
    // n is not a unit vector: n.n stands in the denominator, as the exercise prints it
    var vn = (a.velocity.x - b.velocity.x) * n.x + (a.velocity.y - b.velocity.y) * n.y;
    var J = -(1 + 0.9) * vn / (d2 * (1 / a.mass + 1 / b.mass));
    a.velocity.x += J * n.x / a.mass;
    a.velocity.y += J * n.y / a.mass;
    b.velocity.x += -J * n.x / b.mass;
    b.velocity.y += -J * n.y / b.mass;
  }
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

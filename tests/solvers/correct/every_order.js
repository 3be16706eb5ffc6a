// All ordered pairs, a sphere with itself too: the function returns for it, and for a pair that was set apart before.
numAsteroids = 20;
function sphere(x, y, size, density) {
  return { position: { x, y }, velocity: { x: 0, y: 0 }, force: { x: 0, y: 0 }, alpha: 0, angularVelocity: 0, torque: 0,
    mass: Math.PI * size ** 2 * density, MoI: Math.PI / 2 * size ** 4, size };
}
function initUfo() { ufo = sphere(-3.5, 0, 0.3, 5); }
function initScene() {
  initUfo();
  asteroids = Array.from({ length: numAsteroids }, () =>
    sphere(10 * Math.random() - 5, 6 * Math.random() - 3, 0.08 + 0.22 * Math.random(), 30));
}
function integrate(sphere, dt) {
  const { velocity, position, force, mass } = sphere;
  Object.assign(velocity, { x: velocity.x + force.x / mass * dt, y: velocity.y + force.y / mass * dt });
  Object.assign(position, { x: position.x + velocity.x * dt, y: position.y + velocity.y * dt });
  sphere.angularVelocity += sphere.torque / sphere.MoI * dt;
  sphere.alpha += sphere.angularVelocity * dt;
}
function sphereSphereCollisionHandling(one, two) {
  if (one === two) return;
  const [x, y] = [two.position.x - one.position.x, two.position.y - one.position.y];
  const d = Math.sqrt(x * x + y * y), over = one.size + two.size - d;
  if (over <= 0 || d === 0) return;
  const w = 1 / one.mass, W = 1 / two.mass;
  one.position.x -= x / d * over * w / (w + W); one.position.y -= y / d * over * w / (w + W);
  two.position.x += x / d * over * W / (w + W); two.position.y += y / d * over * W / (w + W);
  const closing = ((one.velocity.x - two.velocity.x) * x + (one.velocity.y - two.velocity.y) * y) / d;
  if (closing <= 0) return;
  const impulse = 1.9 * closing / (w + W);
  one.velocity.x -= impulse * w * x / d; one.velocity.y -= impulse * w * y / d;
  two.velocity.x += impulse * W * x / d; two.velocity.y += impulse * W * y / d;
}
function projectObjects() {
  for (const { position: p } of asteroids) {
    p.x = p.x < -5 ? 5 : p.x > 5 ? -5 : p.x;
    p.y = p.y < -3 ? 3 : p.y > 3 ? -3 : p.y;
  }
  const { x, y } = ufo.position;
  if (x < -5 || x > 5 || y < -3 || y > 3) initUfo();
}
function performSimStep(dt) {
  const all = [ufo, ...asteroids];
  for (const one of all) integrate(one, dt);
  for (const one of all) for (const two of all) sphereSphereCollisionHandling(one, two);
  projectObjects();
}

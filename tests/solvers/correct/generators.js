// Pairs from a generator, vectors as arrays with map and reduce, default arguments.
let ufo, asteroids;
const E = 0.9, AXES = ["x", "y"];
const vec = (v) => AXES.map((k) => v[k]);
const put = (target, v) => AXES.forEach((k, i) => { target[k] = v[i]; });
const add = (a, b, f = 1) => a.map((x, i) => x + f * b[i]);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);

function* pairs(all) {
  for (let j = 0; j < all.length; j++) for (let i = 0; i < j; i++) yield [all[j], all[i]];
}
function make([x, y], size, density) {
  return { position: { x, y }, velocity: { x: 0, y: 0 }, force: { x: 0, y: 0 }, alpha: 0, angularVelocity: 0, torque: 0,
    mass: Math.PI * size ** 2 * density, MoI: Math.PI / 2 * size ** 4, size };
}
function initScene() {
  ufo = make([-3.5, 0], 0.3, 5);
  asteroids = [...Array(20).keys()].map((k) => make([-4.5 + (k % 10), k < 10 ? -2 : 2], 0.1 + k / 200, 30));
}
function integrate(s, dt) {
  put(s.velocity, add(vec(s.velocity), vec(s.force), dt / s.mass));
  put(s.position, add(vec(s.position), vec(s.velocity), dt));
  s.angularVelocity += dt * s.torque / s.MoI;
  s.alpha += dt * s.angularVelocity;
}
function sphereSphereCollisionHandling(a, b) {
  const r = add(vec(a.position), vec(b.position), -1), d = Math.sqrt(dot(r, r));
  if (d >= a.size + b.size || d === 0) return;
  const n = r.map((x) => x / d), depth = a.size + b.size - d;
  put(b.position, add(vec(b.position), n, -depth));  // B gives way, A stays
  const vn = dot(add(vec(a.velocity), vec(b.velocity), -1), n);
  if (vn >= 0) return;
  const J = -(1 + E) * vn / (1 / a.mass + 1 / b.mass);
  [[a, J], [b, -J]].forEach(([s, j]) => put(s.velocity, add(vec(s.velocity), n, j / s.mass)));
}
function projectObjects() {
  const wrap = (x, most) => (x > most ? -most : x < -most ? most : x);
  for (const { position } of asteroids) put(position, [wrap(position.x, 5), wrap(position.y, 3)]);
  if (Math.abs(ufo.position.x) > 5 || Math.abs(ufo.position.y) > 3) put(ufo.position, [-3.5, 0]);
}
function performSimStep(dt) {
  const all = [ufo, ...asteroids];
  all.forEach((s) => integrate(s, dt));
  for (const [a, b] of pairs(all)) sphereSphereCollisionHandling(a, b);
  projectObjects();
}

// gl-matrix with a new array for every result.
function toVec(p) { return vec2.fromValues(p.x, p.y); }

function put(p, v) { p.x = v[0]; p.y = v[1]; }
function integrate(sphere, dt) {
  let v = vec2.scaleAndAdd([], toVec(sphere.velocity), toVec(sphere.force), dt / sphere.mass);
  put(sphere.velocity, v);
  put(sphere.position, vec2.scaleAndAdd([], toVec(sphere.position), v, dt));
  sphere.angularVelocity += dt * sphere.torque / sphere.MoI;
  sphere.alpha += dt * sphere.angularVelocity;
}
function sphereSphereCollisionHandling(sphereA, sphereB) {
  let pa = toVec(sphereA.position), pb = toVec(sphereB.position);
  let dist = vec2.distance(pa, pb);
  if (dist > sphereA.size + sphereB.size) return;
  let n = vec2.normalize([], vec2.subtract([], pa, pb));
  let d = (sphereA.size + sphereB.size - dist) * 0.5;
  put(sphereA.position, vec2.scaleAndAdd([], pa, n, d));
  put(sphereB.position, vec2.scaleAndAdd([], pb, n, -d));
  let va = toVec(sphereA.velocity), vb = toVec(sphereB.velocity);
  let J = -(1 + 0.9) * vec2.dot(vec2.sub([], va, vb), n) / (vec2.dot(n, n) * (1 / sphereA.mass + 1 / sphereB.mass));
  put(sphereA.velocity, vec2.scaleAndAdd([], va, n, J / sphereA.mass));
  put(sphereB.velocity, vec2.scaleAndAdd([], vb, n, -J / sphereB.mass));
}

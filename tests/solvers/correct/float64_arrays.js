// Copies each sphere into a typed array, computes there, and copies back.
"use strict";
const PX = 0, PY = 1, VX = 2, VY = 3, M = 4, R = 5;
function pack(s) {
  return Float64Array.of(s.position.x, s.position.y, s.velocity.x, s.velocity.y, s.mass, s.size);
}
function unpack(a, s) {
  s.position.x = a[PX]; s.position.y = a[PY];
  s.velocity.x = a[VX]; s.velocity.y = a[VY];
}
function integrate(sphere, dt) {
  const a = pack(sphere);
  a[VX] += sphere.force.x / a[M] * dt;
  a[VY] += sphere.force.y / a[M] * dt;
  a[PX] += a[VX] * dt;
  a[PY] += a[VY] * dt;
  unpack(a, sphere);
  sphere.angularVelocity = sphere.angularVelocity + sphere.torque / sphere.MoI * dt;
  sphere.alpha = sphere.alpha + sphere.angularVelocity * dt;
}
function sphereSphereCollisionHandling(sphereA, sphereB) {
  const a = pack(sphereA), b = pack(sphereB), d = Math.hypot(a[PX] - b[PX], a[PY] - b[PY]);
  if (!(d < a[R] + b[R])) return;
  const nx = d > 0 ? (a[PX] - b[PX]) / d : 1, ny = d > 0 ? (a[PY] - b[PY]) / d : 0;
  const middleX = (b[M] * b[PX] + a[M] * a[PX]) / (a[M] + b[M]), middleY = (b[M] * b[PY] + a[M] * a[PY]) / (a[M] + b[M]);
  const far = (a[R] + b[R]) / (a[M] + b[M]);  // about the centre of mass, which stays
  a[PX] = middleX + far * b[M] * nx; a[PY] = middleY + far * b[M] * ny;
  b[PX] = middleX - far * a[M] * nx; b[PY] = middleY - far * a[M] * ny;
  const vn = (a[VX] - b[VX]) * nx + (a[VY] - b[VY]) * ny;
  const J = Math.max(0, -1.9 * vn * a[M] * b[M] / (a[M] + b[M]));
  a[VX] += J * nx / a[M]; a[VY] += J * ny / a[M];
  b[VX] -= J * nx / b[M]; b[VY] -= J * ny / b[M];
  unpack(a, sphereA);
  unpack(b, sphereB);
}

// The change of the relative velocity as a 2 x 2 matrix, I - (1 + e) n nT; a memo of unit vectors that changes nothing.
const seen = new Map();
function unit(x, y) {
  const key = `${x},${y}`;
  if (!seen.has(key)) seen.set(key, [x / Math.hypot(x, y), y / Math.hypot(x, y)]);
  return seen.get(key);
}
function integrate(sphere, dt) {
  sphere.angularVelocity += sphere.torque / sphere.MoI * dt;
  sphere.alpha += sphere.angularVelocity * dt;
  ["x", "y"].forEach((k) => {
    const v = sphere.velocity[k] + sphere.force[k] / sphere.mass * dt;
    sphere.position[k] += v * dt;
    sphere.velocity[k] = v;
  });
}
function sphereSphereCollisionHandling(A, B) {
  const x = A.position.x - B.position.x, y = A.position.y - B.position.y, reach = A.size + B.size;
  if (x * x + y * y > reach * reach || (x === 0 && y === 0)) return;
  const [nx, ny] = unit(x, y), total = A.mass + B.mass;
  const depth = reach - (x * nx + y * ny);
  A.position.x += 0.3 * depth * nx; A.position.y += 0.3 * depth * ny;
  B.position.x -= 0.7 * depth * nx; B.position.y -= 0.7 * depth * ny;
  const u = [A.velocity.x - B.velocity.x, A.velocity.y - B.velocity.y];
  if (u[0] * nx + u[1] * ny >= 0) return;
  const matrix = [[1 - 1.9 * nx * nx, -1.9 * nx * ny], [-1.9 * nx * ny, 1 - 1.9 * ny * ny]];
  const w = matrix.map((row) => row[0] * u[0] + row[1] * u[1]);
  const cx = (A.mass * A.velocity.x + B.mass * B.velocity.x) / total;
  const cy = (A.mass * A.velocity.y + B.mass * B.velocity.y) / total;
  A.velocity.x = cx + B.mass / total * w[0]; A.velocity.y = cy + B.mass / total * w[1];
  B.velocity.x = cx - A.mass / total * w[0]; B.velocity.y = cy - A.mass / total * w[1];
}

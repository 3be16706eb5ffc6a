// ES5: constructor functions with prototypes; the reduced mass; the position as middle and half axis.
function Pair(a, b) {
  this.a = a;
  this.b = b;
  this.x = a.position.x - b.position.x;
  this.y = a.position.y - b.position.y;
  this.length = Math.sqrt(Math.pow(this.x, 2) + Math.pow(this.y, 2));
}
Pair.prototype.overlaps = function () { return this.length < this.a.size + this.b.size && this.length > 0; };
Pair.prototype.normal = function () { return { x: this.x / this.length, y: this.y / this.length }; };
Pair.prototype.separate = function () {
  var half = (this.a.size + this.b.size) / 2, n = this.normal();
  var mx = (this.a.position.x + this.b.position.x) / 2, my = (this.a.position.y + this.b.position.y) / 2;
  this.a.position = { x: mx + half * n.x, y: my + half * n.y };
  this.b.position = { x: mx - half * n.x, y: my - half * n.y };
};
Pair.prototype.bounce = function (e) {
  var n = this.normal(), a = this.a.velocity, b = this.b.velocity;
  var reduced = this.a.mass * this.b.mass / (this.a.mass + this.b.mass);
  var J = -(1 + e) * reduced * (n.x * (a.x - b.x) + n.y * (a.y - b.y));
  if (J < 0) return;
  a.x += J * n.x / this.a.mass;
  a.y += J * n.y / this.a.mass;
  b.x -= J * n.x / this.b.mass;
  b.y -= J * n.y / this.b.mass;
};
function integrate(sphere, dt) {
  var invMass = 1 / sphere.mass, invMoI = 1 / sphere.MoI;
  sphere.velocity = { x: sphere.velocity.x + dt * invMass * sphere.force.x, y: sphere.velocity.y + dt * invMass * sphere.force.y };
  sphere.position = { x: sphere.position.x + dt * sphere.velocity.x, y: sphere.position.y + dt * sphere.velocity.y };
  sphere.angularVelocity += dt * invMoI * sphere.torque;
  sphere.alpha += dt * sphere.angularVelocity;
}
function sphereSphereCollisionHandling(sphereA, sphereB) {
  var pair = new Pair(sphereA, sphereB);
  if (!pair.overlaps()) return;
  var n = pair.normal();
  pair.bounce(0.9);
  pair.separate();
}

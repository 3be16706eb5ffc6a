// A class with private fields and getters; a contact that computes its depth when asked.
class V2 {
  #x; #y;
  constructor(x, y) { this.#x = x; this.#y = y; }
  get x() { return this.#x; } get y() { return this.#y; }
  get len() { return Math.hypot(this.x, this.y); }
  get unit() { return this.times(1 / this.len); }
  times(k) { return new V2(this.x * k, this.y * k); }
  minus(o) { return new V2(this.x - o.x, this.y - o.y); }
  plus(o) { return new V2(this.x + o.x, this.y + o.y); }
  dot(o) { return this.x * o.x + this.y * o.y; }
  static of({ x, y }) { return new V2(x, y); }
  into(target) { target.x = this.x; target.y = this.y; }
}
function integrate(sphere, dt) {
  const v = V2.of(sphere.velocity).plus(V2.of(sphere.force).times(dt / sphere.mass));
  v.into(sphere.velocity);
  V2.of(sphere.position).plus(v.times(dt)).into(sphere.position);
  sphere.angularVelocity = sphere.angularVelocity + dt * sphere.torque / sphere.MoI;
  sphere.alpha = sphere.alpha + dt * sphere.angularVelocity;
}
class Contact {
  constructor(a, b) { Object.assign(this, { a, b }); }
  get axis() { return V2.of(this.a.position).minus(this.b.position); }
  get depth() { return this.a.size + this.b.size - this.axis.len; }
  get touching() { return this.depth > 0; }
  get closing() { return V2.of(this.a.velocity).minus(this.b.velocity).dot(this.axis.unit); }
  separate() {
    const n = this.axis.unit, d = this.depth;
    V2.of(this.a.position).plus(n.times(d / 2)).into(this.a.position);
    V2.of(this.b.position).minus(n.times(d / 2)).into(this.b.position);
    return this;
  }
  bounce(e) {
    const n = this.axis.unit, J = -(1 + e) * this.closing / (1 / this.a.mass + 1 / this.b.mass);
    const { a, b } = this;
    V2.of(a.velocity).plus(n.times(J / a.mass)).into(a.velocity);
    V2.of(b.velocity).minus(n.times(J / b.mass)).into(b.velocity);
  }
}
function sphereSphereCollisionHandling(sphereA, sphereB) {
  const c = new Contact(sphereA, sphereB);
  if (c.touching) c.separate().bounce(0.9);
}

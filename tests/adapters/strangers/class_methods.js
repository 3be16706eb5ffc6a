// A class of balls with vectors: seconds, y down, gravity, bounces that lose speed.
const WIDTH = 640, HEIGHT = 480;
let gravity = 500, restitution = 0.8;

class Vec {
  constructor(x, y) { this.x = x; this.y = y; }
  add(v) { this.x += v.x; this.y += v.y; return this; }
  times(k) { return new Vec(this.x * k, this.y * k); }
  minus(v) { return new Vec(this.x - v.x, this.y - v.y); }
  dot(v) { return this.x * v.x + this.y * v.y; }
  length() { return Math.hypot(this.x, this.y); }
}

class Ball {
  constructor(x, y, r) {
    this.pos = new Vec(x, y);
    this.vel = new Vec(0, 0);
    this.r = r;
    this.m = Math.PI * r * r;
  }

  update(dt) {
    this.vel.y += gravity * dt;
    this.pos.add(this.vel.times(dt));
    this.edges();
  }

  edges() {
    if (this.pos.x < this.r) { this.pos.x = this.r; this.vel.x *= -restitution; }
    if (this.pos.x > WIDTH - this.r) { this.pos.x = WIDTH - this.r; this.vel.x *= -restitution; }
    if (this.pos.y < this.r) { this.pos.y = this.r; this.vel.y *= -restitution; }
    if (this.pos.y > HEIGHT - this.r) { this.pos.y = HEIGHT - this.r; this.vel.y *= -restitution; }
  }

  collide(other) {
    const between = other.pos.minus(this.pos), d = between.length();
    if (d > this.r + other.r || d === 0) return;
    const n = between.times(1 / d), along = other.vel.minus(this.vel).dot(n);
    if (along > 0) return;
    const j = -(1 + restitution) * along / (1 / this.m + 1 / other.m);
    this.vel.add(n.times(-j / this.m));
    other.vel.add(n.times(j / other.m));
  }
}

"use strict";
// Draws the field: earth, asteroids and the ship of the solid engine, the ghosts as outlines in their colours.

const looks = JSON.parse(document.getElementById("looks").textContent);
const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
const SHIP = 0;
const EDGE = 6;  // pixels between a label and the edge of the field
const RIM = "rgb(230 235 245 / .35)", THRUST = "#ffc46b", TEXT = "#f2f4f8";

class Field {
  constructor(canvas) {
    this.canvas = canvas;
    this.field = null;
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  begin(field) {
    Object.assign(this, { field, last: null });
    const [left, bottom, right, top] = field.wrap ?? this.around(field);
    this.view = { left, bottom, right, top };
    this.canvas.closest(".cockpit").style.setProperty("--ratio", (right - left) / (top - bottom));
    this.fit();
  }

  // A scene without a box: all it begins with, and as much room again.
  around(field) {
    const x = field.first.flyers[0].x;
    const corners = field.walls.flatMap(([a, b, c, d]) => [[a, b], [c, d]]);
    field.radius.forEach((r, i) => corners.push([x[2 * i] - 3 * r, x[2 * i + 1] - 3 * r], [x[2 * i] + 3 * r, x[2 * i + 1] + 3 * r]));
    const bounds = (axis) => [Math.min(...corners.map((c) => c[axis])), Math.max(...corners.map((c) => c[axis]))];
    const [[left, right], [bottom, top]] = [bounds(0), bounds(1)];
    const pad = 0.1 * Math.max(right - left, top - bottom);
    return [left - pad, bottom - pad, right + pad, top + pad];
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !this.field) return;
    const sharp = window.devicePixelRatio || 1;
    Object.assign(this.canvas, { width: Math.round(width * sharp), height: Math.round(height * sharp) });
    this.size = [width, height, sharp];
    this.scale = width / (this.view.right - this.view.left);
    if (this.last) this.draw(...this.last);
  }

  pixel(x, y) { return [(x - this.view.left) * this.scale, (this.view.top - y) * this.scale]; }

  // `flyers`: [{name, label, at: [[x, y, angle], ...], gone}], of which number `solid` is the solid one; `marks`: where one diverged.
  draw(flyers, solid, force, marks) {
    this.last = [flyers, solid, force, marks];
    const pen = this.canvas.getContext("2d"), leader = flyers[solid];
    pen.setTransform(this.size[2], 0, 0, this.size[2], 0, 0);
    pen.clearRect(0, 0, ...this.size);
    if (this.field.earth) this.drawEarth(pen, ...this.field.earth);
    this.drawWalls(pen);
    leader.at.forEach((place, disk) => disk === SHIP || this.drawRock(pen, disk, ...place));
    this.drawShip(pen, ...leader.at[SHIP], force);
    flyers.forEach((flyer, k) => k !== solid && !flyer.gone && this.drawGhost(pen, flyer, leader));
    const taken = [this.drawName(pen, leader)];
    marks.forEach((mark, k) => this.drawRing(pen, mark, marks.slice(0, k)));
    marks.forEach((mark) => taken.push(this.drawLabel(pen, mark, taken)));
  }

  drawEarth(pen, x, y, size) {
    this.within(pen, x, y, 0, () => {
      const r = size * this.scale, sea = pen.createRadialGradient(-0.4 * r, -0.4 * r, 0.1 * r, 0, 0, 1.2 * r);
      sea.addColorStop(0, "#5db2ff");
      sea.addColorStop(0.6, "#1e5fae");
      sea.addColorStop(1, "#0a2350");
      pen.fillStyle = sea;
      pen.strokeStyle = "rgb(120 180 255 / .25)";
      pen.lineWidth = 0.2 * r;
      circle(pen, r).fill();
      circle(pen, 1.1 * r).stroke();
    });
  }

  drawWalls(pen) {
    pen.strokeStyle = "#8b959e";
    pen.lineWidth = 2;
    for (const [x0, y0, x1, y1] of this.field.walls) line(pen, this.pixel(x0, y0), this.pixel(x1, y1)).stroke();
  }

  drawRock(pen, disk, x, y, angle) {
    const r = this.field.radius[disk] * this.scale;
    this.within(pen, x, y, angle, () => {
      pen.fillStyle = ["#86807a", "#97918b", "#76706a"][disk % 3];
      pen.strokeStyle = RIM;
      pen.lineWidth = 1;
      circle(pen, r).fill();
      pen.stroke();
      line(pen, [0.55 * r, 0], [r, 0]).stroke();
    });
  }

  drawShip(pen, x, y, angle, [fx, fy, torque]) {
    const r = this.field.radius[SHIP] * this.scale;
    this.within(pen, x, y, angle, () => {
      pen.strokeStyle = RIM;
      pen.lineWidth = 1;
      circle(pen, r).stroke();
      pen.fillStyle = TEXT;
      arrow(pen, r).fill();
      pen.strokeStyle = THRUST;
      pen.lineWidth = 2.5;
      if (torque) circle(pen, 1.15 * r, torque > 0 ? -0.5 : -0.9, torque > 0 ? 0.9 : 0.5).stroke();
    });
    // the flame: against the force, which need not be the heading
    if (fx || fy) this.within(pen, x, y, Math.atan2(fy, fx), () => { pen.fillStyle = THRUST; line(pen, [-0.6 * r, 0.24 * r], [-1.6 * r, 0], [-0.6 * r, -0.24 * r]).fill(); });
  }

  // Faint where it is still with the solid one, so that what has diverged stands out.
  drawGhost(pen, flyer, leader) {
    const look = looks[flyer.name];
    pen.strokeStyle = look.dark;  // the sky is dark on any page
    pen.setLineDash(look.dash);
    flyer.at.forEach(([x, y, angle], disk) => {
      const r = this.field.radius[disk] * this.scale;
      this.within(pen, x, y, angle, () => {
        pen.lineWidth = disk === SHIP ? 2 : 1.3;
        pen.globalAlpha = Math.hypot(x - leader.at[disk][0], y - leader.at[disk][1]) * this.scale > 1.5 ? 1 : 0.3;
        circle(pen, r).stroke();
        (disk === SHIP ? arrow(pen, r) : line(pen, [0.55 * r, 0], [r, 0])).stroke();
      });
    });
    pen.setLineDash([]);
  }

  get large() { return this.size[0] > 500; }

  // Rings at one place lie in each other.
  drawRing(pen, { x, y, name }, earlier) {
    const [px, py] = this.pixel(x, y);
    const inside = earlier.filter((mark) => Math.hypot(...this.pixel(mark.x, mark.y).map((at, k) => at - [px, py][k])) < 12).length;
    const r = (this.large ? 13 : 8) + 4 * inside;
    this.within(pen, x, y, 0, () => {
      pen.strokeStyle = looks[name].dark;
      pen.lineWidth = this.large ? 2 : 1.2;
      circle(pen, r).stroke();
      for (const [dx, dy] of [[1, 0], [0, 1], [-1, 0], [0, -1]]) line(pen, [r * dx, r * dy], [1.6 * r * dx, 1.6 * r * dy]).stroke();
    });
  }

  // Beside its ring, below the labels that are there already; returns the box it takes: left, top, right, bottom in pixels.
  drawLabel(pen, { x, y, name, text }, taken) {
    const [px, py] = this.pixel(x, y);
    const height = this.font(pen), width = pen.measureText(text).width, away = this.large ? 24 : 15;
    const left = px + away + width > this.size[0] - EDGE ? Math.max(EDGE, px - away - width) : Math.max(EDGE, px + away);
    const box = (top) => [left, top, left + width, top + height];
    const meets = (one) => taken.some((other) => one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]);
    const lowest = this.size[1] - height - EDGE, first = Math.min(lowest, Math.max(EDGE, py - 1.2 * height));
    const tops = Array.from({ length: 2 * Math.ceil(this.size[1] / height) }, (_, k) => first + (k % 2 ? -1 : 1) * Math.ceil(k / 2) * height);
    return this.write(pen, text, box(tops.find((top) => top >= EDGE && top <= lowest && !meets(box(top))) ?? first), looks[name].dark);
  }

  // The solid one's name below its ship; returns the box it takes.
  drawName(pen, { label, at }) {
    const [px, py] = this.pixel(...at[SHIP]), r = this.field.radius[SHIP] * this.scale;
    const height = this.font(pen), width = pen.measureText(label).width;
    const left = Math.min(Math.max(EDGE, px - width / 2), this.size[0] - width - EDGE);
    const top = py + r + 3 + height > this.size[1] - EDGE ? py - r - 3 - height : py + r + 3;
    return this.write(pen, label, [left, top, left + width, top + height], TEXT);
  }

  // Height of a line of the field's letters in pixels.
  font(pen) {
    pen.font = `${this.large ? 12 : 10}px system-ui, sans-serif`;
    return this.large ? 15 : 12;
  }

  write(pen, text, box, colour) {
    pen.textBaseline = "top";
    pen.lineWidth = 3;
    pen.strokeStyle = "rgb(8 12 26 / .85)";
    pen.strokeText(text, box[0], box[1] + 1);
    pen.fillStyle = colour;
    pen.fillText(text, box[0], box[1] + 1);
    return box;
  }

  // Paints in pixels about a place of the field, with y down; the pen is as before afterwards.
  within(pen, x, y, angle, paint) {
    pen.save();
    pen.translate(...this.pixel(x, y));
    pen.rotate(-angle);
    paint();
    pen.restore();
  }
}

// Each begins a path of the pen, and returns the pen to stroke or to fill it.
function circle(pen, r, from = 0, to = 2 * Math.PI) { pen.beginPath(); pen.arc(0, 0, r, from, to); return pen; }

function line(pen, first, ...others) { pen.beginPath(); pen.moveTo(...first); others.forEach((place) => pen.lineTo(...place)); return pen; }

function arrow(pen, r) { line(pen, [r, 0], [-0.72 * r, 0.62 * r], [-0.72 * r, -0.62 * r]).closePath(); return pen; }

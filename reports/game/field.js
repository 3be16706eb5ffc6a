"use strict";
// Draws the field: stars, earth, asteroids and the ship of the solid engine, the ghosts as outlines in their colours.

const looks = JSON.parse(document.getElementById("looks").textContent);
const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
const SHIP = 0;
const EDGE = 6;  // pixels between a label and the edge of the field

// The same sky and the same rocks on every visit (a linear congruential generator; Numerical Recipes, 7.1).
function random(seed) {
  let state = seed >>> 0;
  return () => { state = (Math.imul(state, 1664525) + 1013904223) >>> 0; return state / 4294967296; };
}

class Field {
  constructor(canvas) {
    this.canvas = canvas;
    this.sky = document.createElement("canvas");
    this.field = null;
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  begin(field) {
    Object.assign(this, { field, last: null });
    const [left, bottom, right, top] = field.wrap ?? this.around(field);
    this.view = { left, bottom, right, top };
    this.canvas.closest(".cockpit").style.setProperty("--ratio", (right - left) / (top - bottom));
    this.rocks = field.radius.map((_, disk) => this.rock(disk));
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
    Object.assign(this.sky, { width: this.canvas.width, height: this.canvas.height });
    this.size = [width, height, sharp];
    this.scale = width / (this.view.right - this.view.left);
    this.paintSky();
    if (this.last) this.draw(...this.last);
  }

  pixel(x, y) { return [(x - this.view.left) * this.scale, (this.view.top - y) * this.scale]; }

  paintSky() {
    const [width, height, sharp] = this.size;
    const pen = this.sky.getContext("2d");
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    const dusk = pen.createLinearGradient(0, 0, width, height);
    dusk.addColorStop(0, "#0b1020");
    dusk.addColorStop(0.6, "#111a33");
    dusk.addColorStop(1, "#1b1f3f");
    pen.fillStyle = dusk;
    pen.fillRect(0, 0, width, height);
    const next = random(7);
    for (let k = 0; k < width / 3; k++) {
      pen.globalAlpha = 0.15 + 0.6 * next() ** 3;
      pen.fillStyle = next() < 0.15 ? "#ffdcae" : "#dfe8ff";
      pen.beginPath();
      pen.arc(next() * width, next() * height, 0.4 + 1.1 * next() ** 4, 0, 2 * Math.PI);
      pen.fill();
    }
    pen.globalAlpha = 1;
    if (this.field.earth) this.paintEarth(pen);
    pen.strokeStyle = "#8b959e";
    pen.lineWidth = 2;
    for (const [x0, y0, x1, y1] of this.field.walls) {
      pen.beginPath();
      pen.moveTo(...this.pixel(x0, y0));
      pen.lineTo(...this.pixel(x1, y1));
      pen.stroke();
    }
  }

  paintEarth(pen) {
    const [ex, ey, size] = this.field.earth;
    const [x, y] = this.pixel(ex, ey), r = size * this.scale;
    const air = pen.createRadialGradient(x, y, r * 0.9, x, y, r * 1.35);
    air.addColorStop(0, "rgb(120 180 255 / .45)");
    air.addColorStop(1, "rgb(120 180 255 / 0)");
    pen.fillStyle = air;
    pen.beginPath(); pen.arc(x, y, r * 1.35, 0, 2 * Math.PI); pen.fill();
    pen.save();
    pen.beginPath(); pen.arc(x, y, r, 0, 2 * Math.PI); pen.clip();
    const sea = pen.createRadialGradient(x - r * 0.4, y - r * 0.4, r * 0.1, x, y, r * 1.2);
    sea.addColorStop(0, "#5db2ff");
    sea.addColorStop(0.6, "#1e5fae");
    sea.addColorStop(1, "#0a2350");
    pen.fillStyle = sea;
    pen.fillRect(x - r, y - r, 2 * r, 2 * r);
    pen.fillStyle = "rgb(92 150 84 / .9)";
    for (const [dx, dy, a, b, turn] of [[-0.35, -0.3, 0.42, 0.26, 0.5], [0.1, 0.35, 0.24, 0.4, 0.3], [0.55, -0.15, 0.26, 0.36, -0.4]]) {
      pen.beginPath(); pen.ellipse(x + dx * r, y + dy * r, a * r, b * r, turn, 0, 2 * Math.PI); pen.fill();
    }
    pen.fillStyle = "rgb(255 255 255 / .55)";
    for (const [dx, dy, a] of [[0.1, -0.75, 0.5], [-0.3, 0.1, 0.42], [0.35, 0.62, 0.4]]) {
      pen.beginPath(); pen.ellipse(x + dx * r, y + dy * r, a * r, 0.07 * r, -0.15, 0, 2 * Math.PI); pen.fill();
    }
    pen.restore();
  }

  // An outline within the disk, and craters, in units of the radius.
  rock(disk) {
    const next = random(disk * 7919 + 13);
    const outline = Array.from({ length: 11 }, (_, k) => [(k / 11) * 2 * Math.PI, 0.84 + 0.16 * next()]);
    const craters = Array.from({ length: 3 }, () => [0.55 * (2 * next() - 1), 0.55 * (2 * next() - 1), 0.1 + 0.13 * next()]);
    const grey = Math.round(112 + 46 * next());
    return { outline, craters, colour: `rgb(${grey + 10} ${grey} ${grey - 10})`, dark: `rgb(${grey - 34} ${grey - 42} ${grey - 50})` };
  }

  // `flyers`: [{name, label, at: [[x, y, angle], ...], gone}], of which number `solid` is the solid one; `marks`: where one diverged.
  draw(flyers, solid, force, marks) {
    this.last = [flyers, solid, force, marks];
    const pen = this.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.drawImage(this.sky, 0, 0);
    pen.setTransform(this.size[2], 0, 0, this.size[2], 0, 0);
    const leader = flyers[solid];
    leader.at.forEach(([x, y, angle], disk) => disk !== SHIP && this.drawRock(pen, disk, x, y, angle));
    this.drawShip(pen, ...leader.at[SHIP], force);
    flyers.forEach((flyer, k) => k !== solid && !flyer.gone && this.drawGhost(pen, flyer, leader));
    const taken = [this.drawName(pen, leader)];
    marks.forEach((mark, k) => this.drawRing(pen, mark, marks.slice(0, k)));
    marks.forEach((mark) => taken.push(this.drawLabel(pen, mark, taken)));
  }

  within(pen, x, y, angle, paint) { this.withinPixels(pen, ...this.pixel(x, y), -angle, paint); }

  drawRock(pen, disk, x, y, angle) {
    const r = this.field.radius[disk] * this.scale, rock = this.rocks[disk];
    this.within(pen, x, y, angle, () => {
      pen.beginPath();
      rock.outline.forEach(([turn, far], k) => pen[k ? "lineTo" : "moveTo"](far * r * Math.cos(turn), far * r * Math.sin(turn)));
      pen.closePath();
      pen.fillStyle = rock.colour;
      pen.fill();
      pen.fillStyle = rock.dark;
      for (const [cx, cy, size] of rock.craters) { pen.beginPath(); pen.arc(cx * r, cy * r, size * r, 0, 2 * Math.PI); pen.fill(); }
      pen.strokeStyle = "rgb(230 235 245 / .35)";  // the disk that collides
      pen.lineWidth = 1;
      pen.beginPath(); pen.arc(0, 0, r, 0, 2 * Math.PI); pen.stroke();
      pen.beginPath(); pen.moveTo(0.55 * r, 0); pen.lineTo(r, 0); pen.stroke();
    });
  }

  drawShip(pen, x, y, angle, [fx, fy, torque]) {
    const r = this.field.radius[SHIP] * this.scale;
    this.within(pen, x, y, angle, () => {
      pen.strokeStyle = "rgb(230 235 245 / .35)";
      pen.lineWidth = 1;
      pen.beginPath(); pen.arc(0, 0, r, 0, 2 * Math.PI); pen.stroke();
      pen.fillStyle = "#e9edf6";
      pen.strokeStyle = "#9fb0cc";
      pen.beginPath();
      pen.moveTo(r, 0); pen.lineTo(-0.72 * r, 0.62 * r); pen.quadraticCurveTo(-0.35 * r, 0, -0.72 * r, -0.62 * r);
      pen.closePath(); pen.fill(); pen.stroke();
      pen.fillStyle = "#3f6fb5";
      pen.beginPath(); pen.ellipse(0.2 * r, 0, 0.24 * r, 0.15 * r, 0, 0, 2 * Math.PI); pen.fill();
      if (torque) {
        pen.strokeStyle = "#ffc46b";
        pen.lineWidth = 2.5;
        pen.beginPath(); pen.arc(0, 0, 1.15 * r, torque > 0 ? -0.5 : -0.9, torque > 0 ? 0.9 : 0.5); pen.stroke();
      }
    });
    if (!fx && !fy) return;
    this.within(pen, x, y, Math.atan2(fy, fx), () => {  // the flame: against the force, which need not be the heading
      const flame = pen.createLinearGradient(-0.6 * r, 0, -1.7 * r, 0);
      flame.addColorStop(0, "rgb(255 236 170 / .95)");
      flame.addColorStop(1, "rgb(255 120 40 / 0)");
      pen.fillStyle = flame;
      pen.beginPath(); pen.moveTo(-0.5 * r, 0.24 * r); pen.lineTo(-1.75 * r, 0); pen.lineTo(-0.5 * r, -0.24 * r); pen.fill();
    });
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
        const apart = Math.hypot(x - leader.at[disk][0], y - leader.at[disk][1]) * this.scale;
        pen.globalAlpha = apart > 1.5 ? 1 : 0.3;
        pen.beginPath(); pen.arc(0, 0, r, 0, 2 * Math.PI); pen.stroke();
        pen.beginPath();
        if (disk === SHIP) { pen.moveTo(r, 0); pen.lineTo(-0.72 * r, 0.62 * r); pen.lineTo(-0.72 * r, -0.62 * r); pen.closePath(); }
        else { pen.moveTo(0.55 * r, 0); pen.lineTo(r, 0); }
        pen.stroke();
      });
    });
    pen.globalAlpha = 1;
    pen.setLineDash([]);
  }

  get large() { return this.size[0] > 500; }

  // Rings at one place lie in each other.
  drawRing(pen, { x, y, name }, earlier) {
    const [px, py] = this.pixel(x, y);
    const inside = earlier.filter((mark) => Math.hypot(...this.pixel(mark.x, mark.y).map((at, k) => at - [px, py][k])) < 12).length;
    const r = (this.large ? 13 : 8) + 4 * inside;
    pen.strokeStyle = looks[name].dark;
    pen.lineWidth = this.large ? 2 : 1.2;
    pen.beginPath(); pen.arc(px, py, r, 0, 2 * Math.PI); pen.stroke();
    for (const turn of [0, 1, 2, 3]) {
      this.withinPixels(pen, px, py, (turn * Math.PI) / 2, () => { pen.beginPath(); pen.moveTo(r, 0); pen.lineTo(1.6 * r, 0); pen.stroke(); });
    }
  }

  // Beside its ring, below the labels that are there already; returns the box it takes: left, top, right, bottom in pixels.
  drawLabel(pen, { x, y, name, text }, taken) {
    const [px, py] = this.pixel(x, y);
    const line = this.font(pen), width = pen.measureText(text).width, away = this.large ? 24 : 15;
    const left = px + away + width > this.size[0] - EDGE ? Math.max(EDGE, px - away - width) : Math.max(EDGE, px + away);
    const box = (top) => [left, top, left + width, top + line];
    const meets = (one) => taken.some((other) => one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]);
    const lowest = this.size[1] - line - EDGE, first = Math.min(lowest, Math.max(EDGE, py - 1.2 * line));
    const tops = Array.from({ length: 2 * Math.ceil(this.size[1] / line) }, (_, k) => first + (k % 2 ? -1 : 1) * Math.ceil(k / 2) * line);
    const free = box(tops.find((top) => top >= EDGE && top <= lowest && !meets(box(top))) ?? first);
    this.write(pen, text, free, looks[name].dark);
    return free;
  }

  // The solid one's name below its ship; returns the box it takes.
  drawName(pen, { label, at }) {
    const [px, py] = this.pixel(...at[SHIP]), r = this.field.radius[SHIP] * this.scale;
    const line = this.font(pen), width = pen.measureText(label).width;
    const left = Math.min(Math.max(EDGE, px - width / 2), this.size[0] - width - EDGE);
    const top = py + r + 3 + line > this.size[1] - EDGE ? py - r - 3 - line : py + r + 3;
    this.write(pen, label, [left, top], "#f2f4f8");
    return [left, top, left + width, top + line];
  }

  // Height of a line of the field's letters in pixels.
  font(pen) {
    pen.font = `${this.large ? 12 : 10}px system-ui, sans-serif`;
    return this.large ? 15 : 12;
  }

  write(pen, text, [left, top], colour) {
    pen.textBaseline = "top";
    pen.lineWidth = 3;
    pen.strokeStyle = "rgb(8 12 26 / .85)";
    pen.strokeText(text, left, top + 1);
    pen.fillStyle = colour;
    pen.fillText(text, left, top + 1);
  }

  withinPixels(pen, x, y, turn, paint) {
    pen.save();
    pen.translate(x, y);
    pen.rotate(turn);
    paint();
    pen.restore();
  }
}

"use strict";
// The replay player: unpacks what replay.py packed and draws all engines and the truth over each other.

const COLLISION_LASTS = 0.12;  // s of the wall clock at speed 1: long enough to be seen
const FEW = 24;  // more disks than this are drawn without paths and centre marks
const players = {};
window.players = players;

async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Undoes `smoothed` of replay.py: (rows x columns) uint16 from the bytes at `from`.
function smooth(bytes, from, rows, columns) {
  const size = rows * columns, values = new Uint16Array(size), slope = new Uint16Array(columns);
  for (let k = 0; k < size; k++) {
    const zigzag = (bytes[from + k] << 8) | bytes[from + size + k];
    slope[k % columns] += (zigzag >>> 1) ^ -(zigzag & 1);
    values[k] = (k < columns ? 0 : values[k - columns]) + slope[k % columns];
  }
  return values;
}

function readPack(bytes) {
  const view = new DataView(bytes.buffer), length = view.getUint32(0, true);
  const pack = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const n = pack.radius.length;
  let from = 4 + length;
  for (const layer of pack.layers) {
    layer.grid = smooth(bytes, from, layer.frames, 2 * n);
    from += 4 * n * layer.frames;
    if (layer.turns) {
      layer.turn = smooth(bytes, from, layer.frames, n);
      from += 2 * n * layer.frames;
    }
    const number = (k) => view.getUint16(from + 2 * k, true);
    layer.collisions = Array.from({ length: layer.marks }, (_, k) => ({ t: (number(k) / 65535) * pack.duration, disk: number(layer.marks + k) }));
    from += 6 * layer.marks;
  }
  return pack;
}

// m, where a frame of a layer has the centre of a disk; axis 0 is x, 1 is y.
function placeOf(pack, layer, frame, disk, axis) {
  const steps = layer.grid[(frame * pack.radius.length + disk) * 2 + axis];
  return layer.low[axis] + (steps / pack.steps) * layer.span[axis];
}

// A length in m as text, to two digits; from a million on as a power of ten.
const distance = (metres) => metres < 1e6 ? `${Number(metres.toPrecision(2))} m` : `${metres.toExponential(0).replace("e+", "·10^")} m`;

class Player {
  constructor(element, pack, looks) {
    const [slider, clock, button, note, speed, back, forth] = [".scrub", ".clock", ".play", ".ended", ".speed", ".back", ".forth"].map((name) => element.querySelector(name));
    Object.assign(this, { element, looks, slider, clock, button, note, playing: false, speed: Number(speed.value), hidden: new Set() });
    this.sizes = new ResizeObserver(() => this.fit());
    button.onclick = () => this.toggle();
    back.onclick = () => this.stepBy(-1);
    forth.onclick = () => this.stepBy(1);
    speed.onchange = () => { this.speed = Number(speed.value); };
    slider.oninput = () => { this.stop(); this.seek(Number(slider.value)); };
    element.addEventListener("keydown", (event) => this.key(event));
    this.look([...element.querySelectorAll("canvas")].map((canvas) => ({ canvas })));
    this.showPack(pack);
  }

  // Draws on these: { canvas, name } shows one engine over the exact answer, { canvas } all that are not hidden.
  look(views) {
    this.sizes.disconnect();
    this.views = views;
    for (const { canvas } of views) {
      canvas.onclick = () => this.toggle();
      this.sizes.observe(canvas.parentElement);
    }
  }

  // Shows a pack from where it opens; `pace` is how many of its seconds pass in one at speed 1.
  showPack(pack) {
    this.stop();
    Object.assign(this, { pack, pace: pack.pace || 1, from: pack.t[0], until: pack.t.at(-1) });
    Object.assign(this.slider, { min: this.from, max: this.until, step: (this.until - this.from) / 1000 });
    this.disks = pack.radius.map((_, disk) => disk).filter((disk) => !pack.static[disk]);
    this.seek(pack.opens || this.from);
    this.fit();
  }

  key(event) {
    const native = event.target.closest("button, select, input");  // these answer their keys themselves
    if (native && (event.key === " " || native.matches("select, input"))) return;
    const act = {
      " ": () => this.toggle(), ArrowLeft: () => this.stepBy(-1), ArrowRight: () => this.stepBy(1),
      Home: () => this.seek(this.from), End: () => this.seek(this.until),
    }[event.key];
    if (act) { event.preventDefault(); act(); }
  }

  toggle() { this.playing ? this.stop() : this.start(); }

  start() {
    if (this.time >= this.until) this.seek(this.from);
    this.showPlaying(true);
    let before = null;
    const tick = (now) => {
      if (!this.playing) return;
      this.seek(this.time + ((now - (before ?? now)) / 1000) * this.speed * this.pace);
      before = now;
      if (this.time >= this.until) this.stop();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  stop() { this.showPlaying(false); }

  showPlaying(playing) {
    this.playing = playing;
    this.button.textContent = playing ? "❚❚" : "▶";
    this.button.setAttribute("aria-label", playing ? "pause" : "play");
  }

  stepBy(count) {
    this.stop();
    const [k, share] = this.now;
    const next = count > 0 ? k + (share > 0.999 ? 2 : 1) : k - (share > 0.001 ? 0 : 1);
    this.seek(this.pack.t[Math.max(0, Math.min(next, this.pack.t.length - 1))]);
  }

  seek(time) {
    this.time = Math.max(this.from, Math.min(time, this.until));
    this.now = this.frameAt(this.time);
    this.slider.value = this.time;
    this.clock.textContent = `${this.time.toFixed(3)} s of ${Number(this.until.toPrecision(4))} s`;
    this.draw();
  }

  // The last frame at or before `time`, and how far on towards the next it is.
  frameAt(time) {
    const { t } = this.pack, low = Math.max(0, t.findLastIndex((instant) => instant <= time));
    return low + 1 < t.length ? [low, (time - t[low]) / (t[low + 1] - t[low])] : [low, 0];
  }

  label(name) { return this.pack.labels?.[name] ?? (name === "truth" ? "exact answer" : name); }

  ended(layer) { return this.time > this.pack.t[layer.frames - 1] + 1e-9; }

  // m, the size of a torus along an axis; 0 of a plane.
  around(axis) { return this.pack.wrap ? this.pack.wrap[2 + axis] - this.pack.wrap[axis] : 0; }

  // m, between the places a and b of a disk; on a torus the shorter way.
  distance(a, b) {
    return Math.hypot(...[0, 1].map((axis) => {
      const size = this.around(axis), gap = a[axis] - b[axis];
      return size ? gap - size * Math.round(gap / size) : gap;
    }));
  }

  // Whether a disk left a torus between two places, and came in again opposite.
  jumps(a, b, axis) { return this.pack.wrap && Math.abs(a - b) > this.around(axis) / 2; }

  // [[x, y], ...] m of an engine's disks now; on a straight line between the packed samples. null once it has ended.
  positions(name) {
    const layer = this.pack.layers.find((each) => each.name === name);
    return !layer || this.ended(layer) ? null : this.pack.radius.map((_, disk) => this.place(layer, disk));
  }

  place(layer, disk) {
    const [k, share] = this.now;
    return [0, 1].map((axis) => {
      const here = placeOf(this.pack, layer, k, disk, axis);
      if (!share || k + 1 >= layer.frames) return here;
      const next = placeOf(this.pack, layer, k + 1, disk, axis);
      return this.jumps(here, next, axis) ? here : here + share * (next - here);
    });
  }

  angle(layer, disk) {
    const n = this.pack.radius.length, [k, share] = this.now;
    const here = layer.turn[k * n + disk];
    const next = k + 1 < layer.frames ? layer.turn[(k + 1) * n + disk] : here;
    const turn = ((next - here + 98304) & 65535) - 32768;  // the shorter way round
    return ((here + share * turn) / 65536) * 2 * Math.PI;
  }

  // The plane fitted into each canvas, whose height the style sheet fits to the view.
  fit() {
    for (const view of this.views) {
      const { clientWidth: width, clientHeight: height } = view.canvas;
      if (!width) continue;
      const [left, bottom, right, top] = this.pack.view;
      const margin = view.name ? 8 : 16, foot = 18;  // px around the picture, and below it for the scale bar
      const sharp = window.devicePixelRatio || 1;
      view.scale = Math.min((width - 2 * margin) / (right - left), (height - 2 * margin - foot) / (top - bottom));
      view.centre = [(width - view.scale * (left + right)) / 2, (height - foot + view.scale * (top + bottom)) / 2];
      Object.assign(view.canvas, { width: Math.round(width * sharp), height: Math.round(height * sharp) });
      view.size = [width, height, sharp];
    }
    this.draw();
  }

  draw() {
    this.views.filter((view) => view.size).forEach((view) => this.drawView(view));
    this.note.textContent = this.pack.layers.filter((layer) => !this.hidden.has(layer.name) && this.ended(layer))
      .map((layer) => `${this.label(layer.name)} ends at ${layer.ends} s`).join("; ");
  }

  drawView({ canvas, name, size, scale, centre }) {
    const pen = canvas.getContext("2d"), css = getComputedStyle(this.element);
    const [soft, wall, exact, bad] = ["--soft", "--wall", "--exact", "--bad"].map((variable) => css.getPropertyValue(variable));
    Object.assign(this, { pen, size, scale, centre, ink: { soft, wall, exact, bad } });
    pen.setTransform(size[2], 0, 0, size[2], 0, 0);
    pen.clearRect(0, 0, size[0], size[1]);
    const shown = (layer) => name ? ["truth", name].includes(layer.name) : !this.hidden.has(layer.name);
    const layers = this.pack.layers.filter(shown);
    if (name) layers.sort((a) => a.name === "truth" ? -1 : 1);
    const few = this.pack.radius.length <= FEW, going = layers.filter((layer) => !this.ended(layer));
    this.drawWalls();
    if (few) layers.forEach((layer) => this.drawPath(layer));
    for (const layer of going) this.drawDisks(layer, few, layers.length - layers.indexOf(layer), Boolean(name));
    layers.forEach((layer) => this.drawCollisions(layer));
    if (few) going.forEach((layer) => this.drawAway(layer));
    this.drawEvent(layers);
    this.drawScaleBar();
  }

  pixel([x, y]) { return [this.centre[0] + this.scale * x, this.centre[1] - this.scale * y]; }

  colour(layer) { return this.looks[layer.name][darkPage() ? "dark" : "light"]; }

  circle(x, y, r) { this.pen.beginPath(); this.pen.arc(x, y, r, 0, 2 * Math.PI); }

  // A line through pixels; null begins it anew.
  polyline(...points) {
    this.pen.beginPath();
    points.forEach((point, k) => { if (point) this.pen[points[k - 1] ? "lineTo" : "moveTo"](...point); });
    this.pen.stroke();
  }

  // And the static disks, which nobody moves.
  drawWalls() {
    const { pen, pack } = this, [layer] = pack.layers;
    pen.setLineDash([]);
    pen.strokeStyle = pen.fillStyle = this.ink.wall;
    pen.lineWidth = 2;
    for (const [x0, y0, x1, y1] of pack.walls) this.polyline(this.pixel([x0, y0]), this.pixel([x1, y1]));
    if (pack.wrap) {
      const [left, bottom, right, top] = pack.wrap;
      pen.setLineDash([2, 4]);
      pen.lineWidth = 1;
      pen.strokeRect(...this.pixel([left, top]), this.scale * (right - left), this.scale * (top - bottom));
    }
    pack.radius.forEach((radius, disk) => {
      if (!pack.static[disk]) return;
      this.circle(...this.pixel([0, 1].map((axis) => placeOf(pack, layer, 0, disk, axis))), radius * this.scale);
      pen.fill();
    });
  }

  // Where the centres go in the whole replay, faintly: the still picture then says what happens.
  drawPath(layer) {
    const { pen, pack } = this;
    pen.setLineDash([]);
    pen.globalAlpha = 0.3;
    pen.lineWidth = 1;
    pen.strokeStyle = this.colour(layer);
    for (const disk of this.disks) {
      const points = [];
      let before = null;
      for (let k = 0; k < layer.frames; k++) {
        const here = [0, 1].map((axis) => placeOf(pack, layer, k, disk, axis));
        if (before && [0, 1].some((axis) => this.jumps(here[axis], before[axis], axis))) points.push(null);
        points.push(this.pixel(here));
        before = here;
      }
      this.polyline(...points);
    }
    pen.globalAlpha = 1;
  }

  drawDisks(layer, few, rank, under) {
    const { pen } = this, look = this.looks[layer.name], truth = layer.name === "truth";
    pen.strokeStyle = pen.fillStyle = truth && under ? this.ink.exact : this.colour(layer);
    for (const disk of this.disks) {
      const [x, y] = this.pixel(this.place(layer, disk));
      const r = Math.max(1.5, this.pack.radius[disk] * this.scale);
      this.circle(x, y, r);
      pen.globalAlpha = truth ? 1 : 0.09;
      if (!truth || under) pen.fill();
      pen.globalAlpha = 1;
      pen.setLineDash(look.dash);
      // Coinciding outlines stay visible as rings in each other: the lower the layer, the wider its line.
      pen.lineWidth = truth ? 1.2 : few ? 1.4 + 0.45 * Math.min(rank, 8) : 1.2;
      pen.stroke();
      pen.setLineDash([]);
      pen.lineWidth = 1.2;
      if (layer.turns && !(truth && under)) {
        const angle = this.angle(layer, disk);
        this.polyline([x, y], [x + r * Math.cos(angle), y - r * Math.sin(angle)]);
      }
      if (few && !truth && r > 9) {
        pen.save();
        pen.translate(x, y);
        pen[look.filled ? "fill" : "stroke"](new Path2D(look.path));
        pen.restore();
      }
    }
  }

  drawCollisions(layer) {
    const lasts = COLLISION_LASTS * Math.max(this.speed, 0.25) * this.pace;
    for (const { t, disk } of layer.collisions) {
      const age = (this.time - t) / lasts;
      if (age < 0 || age > 1 || disk >= this.pack.radius.length) continue;
      this.pen.globalAlpha = 1 - age;
      this.pen.strokeStyle = this.colour(layer);
      this.pen.lineWidth = 2;
      this.circle(...this.pixel(this.place(layer, disk)), this.pack.radius[disk] * this.scale + 3 + 9 * age);
      this.pen.stroke();
      this.pen.globalAlpha = 1;
    }
  }

  // Where a disk is that has left the picture: an arrow at the edge, and how far beyond it the disk's centre is.
  drawAway(layer) {
    const { pen } = this, [width, height] = this.size, edge = 14;
    pen.strokeStyle = pen.fillStyle = this.colour(layer);
    pen.font = "600 12px system-ui, sans-serif";
    pen.textBaseline = "middle";
    for (const disk of this.disks) {
      const [x, y] = this.pixel(this.place(layer, disk)), r = this.pack.radius[disk] * this.scale;
      if (x > -r && x < width + r && y > -r && y < height + r) continue;
      const at = [Math.max(edge, Math.min(x, width - edge)), Math.max(edge, Math.min(y, height - edge))];
      const beyond = Math.hypot(x - at[0], y - at[1]) / this.scale, late = at[0] > width / 2;
      pen.save();
      pen.translate(...at);
      pen.rotate(Math.atan2(y - at[1], x - at[0]));
      pen.fill(new Path2D("M10,0L-6,7L-6,-7Z"));
      pen.restore();
      pen.textAlign = late ? "right" : "left";
      pen.fillText(`${distance(beyond)} away`, at[0] + (late ? -16 : 16), at[1]);
    }
    pen.textBaseline = "alphabetic";
  }

  // What broke: a ring around its disk of the first layer, from the instant on.
  drawEvent([layer]) {
    const { pen } = this, { event } = this.pack;
    if (!event || !layer || this.time < event.t - 1e-9) return;
    pen.strokeStyle = pen.fillStyle = this.ink.bad;
    pen.lineWidth = 2.5;
    pen.setLineDash([5, 4]);
    if (event.disk >= 0) {
      this.circle(...this.pixel(this.place(layer, event.disk)), Math.max(6, this.pack.radius[event.disk] * this.scale + 6));
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.font = "600 13px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.fillText("fails here", 12, 20);
  }

  drawScaleBar() {
    const { pen } = this, [width, height] = this.size;
    const most = (0.2 * width) / this.scale, power = 10 ** Math.floor(Math.log10(most));
    const length = power * [5, 2, 1].find((k) => k * power <= most);
    const right = width - 12, left = right - length * this.scale;
    pen.strokeStyle = pen.fillStyle = this.ink.soft;
    pen.lineWidth = 1.5;
    this.polyline([left, height - 12], [left, height - 7], [right, height - 7], [right, height - 12]);
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.fillText(`${Number(length.toPrecision(3))} m`, left - 6, height - 6);
  }
}

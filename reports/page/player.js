"use strict";
// The replay player: unpacks what replay.py packed and draws all engines and the truth over each other.

const players = {};
window.players = players;

function unpack(id) { return inflate(document.getElementById(id).textContent); }

async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Undoes `smoothed` of replay.py: (rows x columns) uint16 from the bytes at `from`.
function smooth(bytes, from, rows, columns) {
  const size = rows * columns;
  const values = new Uint16Array(size);
  const slope = new Uint16Array(columns);
  for (let k = 0; k < size; k++) {
    const zigzag = (bytes[from + k] << 8) | bytes[from + size + k];
    const c = k % columns;
    slope[c] += (zigzag >>> 1) ^ -(zigzag & 1);
    values[k] = (k < columns ? 0 : values[k - columns]) + slope[c];
  }
  return values;
}

function readPack(bytes) {
  const view = new DataView(bytes.buffer);
  const length = view.getUint32(0, true);
  const pack = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const n = pack.radius.length;
  let from = 4 + length;
  for (const layer of pack.layers) {
    layer.grid = smooth(bytes, from, layer.frames, 2 * n);
    from += 4 * n * layer.frames;
    if (layer.turns) {
      layer.angle = smooth(bytes, from, layer.frames, n);
      from += 2 * n * layer.frames;
    }
    const number = (k) => view.getUint16(from + 2 * k, true);
    layer.hitList = Array.from({ length: layer.marks }, (_, k) => ({
      t: (number(k) / 65535) * pack.duration, i: number(layer.marks + k), j: number(2 * layer.marks + k),
    }));
    from += 6 * layer.marks;
  }
  return pack;
}

// m, where a frame of a layer has the centre of a disk; axis 0 is x, 1 is y.
function placeOf(pack, layer, frame, disk, axis) {
  const steps = layer.grid[(frame * pack.radius.length + disk) * 2 + axis];
  return layer.low[axis] + (steps / pack.steps) * layer.span[axis];
}

class Player {
  constructor(element, pack, looks) {
    const speed = Number(element.querySelector(".speed").value);
    Object.assign(this, { element, looks, playing: false, speed, hidden: new Set(), views: [] });
    this.slider = element.querySelector(".scrub");
    this.clock = element.querySelector(".clock");
    this.button = element.querySelector(".play");
    this.note = element.querySelector(".ended");
    this.sizes = new ResizeObserver(() => this.fit());
    this.listen();
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
    this.pack = pack;
    this.pace = pack.pace || 1;
    [this.from, this.until] = [pack.t[0], pack.t[pack.t.length - 1]];
    this.slider.min = this.from;
    this.slider.max = this.until;
    this.slider.step = (this.until - this.from) / 1000;
    this.time = pack.opens || this.from;
    this.fit();
    this.seek(this.time);
  }

  listen() {
    this.button.onclick = () => this.toggle();
    this.element.querySelector(".back").onclick = () => this.stepBy(-1);
    this.element.querySelector(".forth").onclick = () => this.stepBy(1);
    this.element.querySelector(".speed").onchange = (event) => { this.speed = Number(event.target.value); };
    this.slider.oninput = () => { this.stop(); this.seek(Number(this.slider.value)); };
    this.element.addEventListener("keydown", (event) => this.key(event));
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
    this.playing = true;
    this.showPlaying();
    let before = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      this.seek(this.time + ((now - before) / 1000) * this.speed * this.pace);
      before = now;
      if (this.time >= this.until) this.stop();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame((now) => { before = now; tick(now); });
  }

  stop() { this.playing = false; this.showPlaying(); }

  showPlaying() {
    this.button.textContent = this.playing ? "❚❚" : "▶";
    this.button.setAttribute("aria-label", this.playing ? "pause" : "play");
  }

  stepBy(count) {
    this.stop();
    const [k, share] = this.frameAt(this.time);
    const next = count > 0 ? k + (share > 0.999 ? 2 : 1) : k - (share > 0.001 ? 0 : 1);
    this.seek(this.pack.t[Math.max(0, Math.min(next, this.pack.t.length - 1))]);
  }

  seek(time) {
    this.time = Math.max(this.from, Math.min(time, this.until));
    this.slider.value = this.time;
    this.clock.textContent = `${this.time.toFixed(3)} s of ${Number(this.until.toPrecision(4))} s`;
    this.draw();
  }

  // The last frame at or before `time`, and how far on towards the next it is.
  frameAt(time) {
    const t = this.pack.t;
    let low = 0, high = t.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (t[middle] <= time) low = middle; else high = middle - 1;
    }
    return low + 1 < t.length ? [low, (time - t[low]) / (t[low + 1] - t[low])] : [low, 0];
  }

  layer(name) { return this.pack.layers.find((layer) => layer.name === name); }

  ended(layer) { return this.time > this.pack.t[layer.frames - 1] + 1e-9; }

  // m, between the places a and b of a disk; on a torus the shorter way.
  distance(a, b) {
    const box = this.pack.wrap;
    return Math.hypot(...[0, 1].map((axis) => {
      const size = box ? box[2 + axis] - box[axis] : 0, gap = a[axis] - b[axis];
      return size ? gap - size * Math.round(gap / size) : gap;
    }));
  }

  // [[x, y], ...] m of an engine's disks now; on a straight line between the packed samples. null once it has ended.
  positions(name) {
    const layer = this.layer(name);
    return !layer || this.ended(layer) ? null : this.pack.radius.map((_, disk) => this.place(layer, disk));
  }

  place(layer, disk) {
    const [k, share] = this.frameAt(this.time);
    return [0, 1].map((axis) => {
      const here = placeOf(this.pack, layer, k, disk, axis);
      if (!share || k + 1 >= layer.frames) return here;
      const gap = placeOf(this.pack, layer, k + 1, disk, axis) - here;
      const box = this.pack.wrap;
      const jumps = box && Math.abs(gap) > (box[2 + axis] - box[axis]) / 2;  // it left and came in again opposite
      return jumps ? here : here + share * gap;
    });
  }

  angle(layer, disk) {
    const n = this.pack.radius.length;
    const [k, share] = this.frameAt(this.time);
    const here = layer.angle[k * n + disk];
    const next = k + 1 < layer.frames ? layer.angle[(k + 1) * n + disk] : here;
    const turn = ((next - here + 98304) & 65535) - 32768;  // the shorter way round
    return ((here + share * turn) / 65536) * 2 * Math.PI;
  }

  show(name, visible) {
    visible ? this.hidden.delete(name) : this.hidden.add(name);
    this.draw();
  }
}

"use strict";
// How the player's picture is drawn: the plane fitted into the canvas, walls, paths, disks, collisions, the scale bar.

const COLLISION_LASTS = 0.12;  // s of the wall clock at speed 1: long enough to be seen
const FEW = 24;  // more disks than this are drawn without paths and centre marks

// A length in m as text, to two digits; from a million on as a power of ten.
const distance = (metres) => metres < 1e6 ? `${Number(metres.toPrecision(2))} m` : `${metres.toExponential(0).replace("e+", "·10^")} m`;

Object.assign(Player.prototype, {
  fit() {
    for (const view of this.views) {
      const { clientWidth: width, clientHeight: height } = view.canvas;  // the style sheet fits the height to the view
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
  },

  pixel([x, y]) { return [this.centre[0] + this.scale * x, this.centre[1] - this.scale * y]; },

  draw() {
    this.views.filter((view) => view.size).forEach((view) => this.drawView(view));
    this.note.textContent = this.pack.layers.filter((layer) => !this.hidden.has(layer.name) && this.ended(layer))
      .map((layer) => `${this.label(layer.name)} ends at ${layer.ends} s`).join("; ");
  },

  label(name) { return this.pack.labels?.[name] ?? (name === "truth" ? "exact answer" : name); },

  drawView(view) {
    Object.assign(this, { size: view.size, scale: view.scale, centre: view.centre });
    const pen = view.canvas.getContext("2d");
    const css = getComputedStyle(this.element);
    const [text, soft, wall, exact] = ["--text", "--soft", "--wall", "--exact"].map((name) => css.getPropertyValue(name));
    this.ink = { text, soft, wall, exact };
    pen.setTransform(this.size[2], 0, 0, this.size[2], 0, 0);
    pen.clearRect(0, 0, this.size[0], this.size[1]);
    this.drawWalls(pen);
    const names = view.name ? ["truth", view.name] : null;
    const layers = this.pack.layers.filter((layer) => names ? names.includes(layer.name) : !this.hidden.has(layer.name));
    if (names) layers.sort((a) => a.name === "truth" ? -1 : 1);
    const few = this.pack.radius.length <= FEW;
    this.drawStatic(pen);
    if (few) layers.forEach((layer) => this.drawPath(pen, layer));
    layers.forEach((layer, k) => this.ended(layer) || this.drawDisks(pen, layer, few, layers.length - k, Boolean(names)));
    layers.forEach((layer) => this.drawCollisions(pen, layer));
    if (few) layers.forEach((layer) => this.ended(layer) || this.drawAway(pen, layer));
    this.drawEvent(pen, layers);
    this.drawScaleBar(pen);
  },

  colour(layer) { return this.looks[layer.name][darkPage() ? "dark" : "light"]; },

  drawWalls(pen) {
    pen.setLineDash([]);
    pen.strokeStyle = this.ink.wall;
    pen.lineWidth = 2;
    for (const [x0, y0, x1, y1] of this.pack.walls) {
      pen.beginPath();
      pen.moveTo(...this.pixel([x0, y0]));
      pen.lineTo(...this.pixel([x1, y1]));
      pen.stroke();
    }
    if (!this.pack.wrap) return;
    const [left, bottom, right, top] = this.pack.wrap;
    pen.setLineDash([2, 4]);
    pen.lineWidth = 1;
    pen.strokeRect(...this.pixel([left, top]), this.scale * (right - left), this.scale * (top - bottom));
  },

  // Nobody moves these, so they are drawn once, and for all.
  drawStatic(pen) {
    const [layer] = this.pack.layers;
    pen.fillStyle = this.ink.wall;
    this.pack.radius.forEach((radius, disk) => {
      if (!this.pack.static[disk]) return;
      pen.beginPath();
      pen.arc(...this.pixel([0, 1].map((axis) => placeOf(this.pack, layer, 0, disk, axis))), radius * this.scale, 0, 2 * Math.PI);
      pen.fill();
    });
  },

  // Where the centres go in the whole replay, faintly: the still picture then says what happens.
  drawPath(pen, layer) {
    const box = this.pack.wrap;
    pen.setLineDash([]);
    pen.globalAlpha = 0.3;
    pen.lineWidth = 1;
    pen.strokeStyle = this.colour(layer);
    this.pack.radius.forEach((_, disk) => {
      if (this.pack.static[disk]) return;
      let before = null;
      pen.beginPath();
      for (let k = 0; k < layer.frames; k++) {
        const here = [placeOf(this.pack, layer, k, disk, 0), placeOf(this.pack, layer, k, disk, 1)];
        const jumps = before && box && [0, 1].some((a) => Math.abs(here[a] - before[a]) > (box[2 + a] - box[a]) / 2);
        before && !jumps ? pen.lineTo(...this.pixel(here)) : pen.moveTo(...this.pixel(here));
        before = here;
      }
      pen.stroke();
    });
    pen.globalAlpha = 1;
  },

  drawDisks(pen, layer, few, rank, under) {
    const look = this.looks[layer.name];
    const truth = layer.name === "truth";
    const colour = truth && under ? this.ink.exact : this.colour(layer);
    pen.strokeStyle = pen.fillStyle = colour;
    this.pack.radius.forEach((radius, disk) => {
      if (this.pack.static[disk]) return;
      const [x, y] = this.pixel(this.place(layer, disk));
      const r = Math.max(1.5, radius * this.scale);
      pen.beginPath();
      pen.arc(x, y, r, 0, 2 * Math.PI);
      pen.globalAlpha = truth ? 1 : 0.09;
      if (!truth || under) pen.fill();
      pen.globalAlpha = 1;
      pen.setLineDash(look.dash);
      // Coinciding outlines stay visible as rings in each other: the lower the layer, the wider its line.
      pen.lineWidth = truth ? 1.2 : few ? 1.4 + 0.45 * Math.min(rank, 8) : 1.2;
      pen.stroke();
      pen.setLineDash([]);
      pen.lineWidth = 1.2;
      if (layer.turns && !(truth && under)) this.drawSpoke(pen, [x, y], r, this.angle(layer, disk));
      if (few && !truth && r > 9) this.drawMark(pen, look, x, y);
    });
  },

  drawSpoke(pen, [x, y], r, angle) {
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + r * Math.cos(angle), y - r * Math.sin(angle));
    pen.stroke();
  },

  drawMark(pen, look, x, y) {
    const mark = new Path2D(look.path);
    pen.save();
    pen.translate(x, y);
    look.filled ? pen.fill(mark) : pen.stroke(mark);
    pen.restore();
  },

  drawCollisions(pen, layer) {
    const lasts = COLLISION_LASTS * Math.max(this.speed, 0.25) * this.pace;
    for (const collision of layer.hitList) {
      const age = (this.time - collision.t) / lasts;
      if (age < 0 || age > 1 || collision.i >= this.pack.radius.length) continue;
      const [x, y] = this.pixel(this.place(layer, collision.i));
      pen.globalAlpha = 1 - age;
      pen.strokeStyle = this.colour(layer);
      pen.lineWidth = 2;
      pen.beginPath();
      pen.arc(x, y, this.pack.radius[collision.i] * this.scale + 3 + 9 * age, 0, 2 * Math.PI);
      pen.stroke();
      pen.globalAlpha = 1;
    }
  },

  // Where a disk is that has left the picture: an arrow at the edge, and how far beyond it the disk's centre is.
  drawAway(pen, layer) {
    const [width, height] = this.size, edge = 14;
    pen.strokeStyle = pen.fillStyle = this.colour(layer);
    pen.font = "600 12px system-ui, sans-serif";
    pen.textBaseline = "middle";
    this.pack.radius.forEach((radius, disk) => {
      if (this.pack.static[disk]) return;
      const [x, y] = this.pixel(this.place(layer, disk)), r = radius * this.scale;
      if (x > -r && x < width + r && y > -r && y < height + r) return;
      const at = [Math.max(edge, Math.min(x, width - edge)), Math.max(edge, Math.min(y, height - edge))];
      const beyond = Math.hypot(x - at[0], y - at[1]) / this.scale;
      pen.save();
      pen.translate(...at);
      pen.rotate(Math.atan2(y - at[1], x - at[0]));
      pen.beginPath(); pen.moveTo(10, 0); pen.lineTo(-6, 7); pen.lineTo(-6, -7); pen.closePath(); pen.fill();
      pen.restore();
      pen.textAlign = at[0] > width / 2 ? "right" : "left";
      pen.fillText(`${distance(beyond)} away`, at[0] + (at[0] > width / 2 ? -16 : 16), at[1]);
    });
    pen.textBaseline = "alphabetic";
  },

  // What broke: a ring around its disk of the first layer, from the instant on.
  drawEvent(pen, layers) {
    const event = this.pack.event;
    if (!event || !layers.length || this.time < event.t - 1e-9) return;
    const disks = event.disk < 0 ? [] : [event.disk];
    pen.strokeStyle = pen.fillStyle = getComputedStyle(this.element).getPropertyValue("--bad");
    pen.lineWidth = 2.5;
    pen.setLineDash([5, 4]);
    for (const disk of disks) {
      const [x, y] = this.pixel(this.place(layers[0], disk));
      pen.beginPath();
      pen.arc(x, y, Math.max(6, this.pack.radius[disk] * this.scale + 6), 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.font = "600 13px system-ui, sans-serif";
    pen.textAlign = "left";
    pen.fillText("fails here", 12, 20);
  },

  drawScaleBar(pen) {
    const [width, height] = this.size;
    const wanted = (0.2 * width) / this.scale;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = power * [5, 2, 1].find((k) => k * power <= wanted);
    const right = width - 12;
    pen.strokeStyle = pen.fillStyle = this.ink.soft;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(right - length * this.scale, height - 12);
    pen.lineTo(right - length * this.scale, height - 7);
    pen.lineTo(right, height - 7);
    pen.lineTo(right, height - 12);
    pen.stroke();
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.fillText(`${Number(length.toPrecision(3))} m`, right - length * this.scale - 6, height - 6);
  },
});

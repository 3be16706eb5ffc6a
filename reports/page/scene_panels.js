"use strict";
// The same scene in every engine: a panel each, with what it moves drawn over the exact answer.

const FRAME = { width: 206, height: 166, left: 38, right: 10, top: 20, bottom: 32 };

async function openPanels(section) {
  const scenes = JSON.parse(new TextDecoder().decode(await unpack("panels:all")));
  const pick = section.querySelector("select");
  const show = () => showPanels(section, scenes[pick.value], pick.value);
  pick.onchange = show;
  document.querySelectorAll("a[data-panels]").forEach((link) => {
    link.onclick = () => { pick.value = link.dataset.panels; show(); };
  });
  await show();
}

async function showPanels(section, scene, name) {
  const pack = readPack(await unpack(`replay:${name}`));
  if (section.querySelector("select").value !== name) return;  // another one has been chosen meanwhile
  section.querySelector(".asks").textContent = document.getElementById(`s-${name}`).querySelector(".asks").textContent;
  section.querySelector(".says").textContent = scene.says;
  section.querySelector(".more").href = `#s-${name}`;
  const shown = { ...scene, pack, timed: "timed" in section.dataset, tracks: tracksOf(pack, scene), marked: framesAt(pack, scene.until, Number(section.dataset.marked)) };
  for (const panel of section.querySelectorAll(".panel")) {
    panel.hidden = !(panel.dataset.name in scene.engines);
    if (!panel.hidden) fillPanel(panel, shown);
  }
  section.dataset.shown = name;
}

function fillPanel(panel, shown) {
  const name = panel.dataset.name;
  const [outcome, reason, error, cost] = shown.engines[name];
  const text = panel.querySelector(".outcome-of");
  text.replaceChildren();
  if (outcome) text.append(bold(outcome), reason && `: ${reason}`);
  else text.append("error: ", bold(error));
  if (!outcome && shown.timed) text.append(document.createElement("br"), cost ? `cost: ${cost}` : "not timed");
  text.classList.toggle("outcome", Boolean(outcome));
  panel.querySelector(".paths").replaceChildren(pictureOf(name, shown));
}

function bold(text) {
  const element = document.createElement("b");
  element.textContent = text;
  return element;
}

function drawing(name, attributes, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

// Layer -> for each disk that is drawn its points [x, y] in the units of the axes, frame by frame until the exact answer
// ends.
function tracksOf(pack, scene) {
  const until = pack.t.filter((t) => t <= scene.until * (1 + 1e-6)).length;
  return new Map(pack.layers.map((layer) => {
    const frames = Array.from({ length: Math.min(until, layer.frames) }, (_, k) => k);
    const place = (disk, axis) => frames.map((k) => placeOf(pack, layer, k, disk, axis));
    const over = (values, others) => values.map((value, k) => [value, others[k]]);
    const track = {
      path: (disk) => over(place(disk, 0), place(disk, 1)),
      x: (disk) => over(frames.map((k) => pack.t[k]), place(disk, 0)),
      y: (disk) => over(frames.map((k) => pack.t[k]), place(disk, 1)),
    }[scene.axes];
    return [layer.name, scene.disks.map(track)];
  }));
}

// The frames nearest to so many instants, evenly spread up to `until`.
function framesAt(pack, until, count) {
  const far = (k, t) => Math.abs(pack.t[k] - t);
  return Array.from({ length: count }, (_, j) => until * (j + 0.5) / count)
    .map((t) => pack.t.reduce((best, _, k) => far(k, t) < far(best, t) ? k : best, 0));
}

function pictureOf(name, shown) {
  const { width, height, left, right, top, bottom } = FRAME;
  const [across, up] = [width - left - right, height - top - bottom];
  const [x, y] = scalesOf(shown, across, up);
  const [exact, mine] = ["truth", name].map((each) => shown.tracks.get(each) ?? []);
  const line = (track) => lineOf(track, x, y, shown.axes === "path" && shown.pack.wrap);
  const points = (track) => shown.marked.filter((k) => k < track.length).map((k) => [x.place(track[k][0]), y.place(track[k][1])]);
  const inside = drawing("svg", { x: left, y: top, width: across, height: up });  // nothing is drawn beyond it
  if (shown.axes === "path") drawSurroundings(inside, shown.pack, x, y);
  inside.append(...exact.map((track) => drawing("path", { class: "exact", d: line(track) })));
  inside.append(engineOf(name, mine.map(line), mine.flatMap(points)));
  inside.append(...exact.flatMap(points).map(([cx, cy]) => drawing("circle", { class: "exact-mark", cx, cy, r: 2 })));
  const says = `${shown.titles[1]} against ${shown.titles[0]} of ${name} over the exact answer`;
  const picture = drawing("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": says });
  drawAxesOf(picture, shown.titles, x, y);
  picture.append(inside);
  return picture;
}

function engineOf(name, lines, points) {
  const look = looks[name];
  const group = drawing("g", { class: `k${Object.keys(looks).indexOf(name)}` });
  group.append(...lines.map((d) => drawing("path", { class: "track", d, "stroke-dasharray": look.dash.join(",") })));
  group.append(...points.map(([px, py]) => drawing("path", {
    class: look.filled ? "sign" : "sign open", d: look.path, transform: `translate(${px.toFixed(1)},${py.toFixed(1)})`,
  })));
  return group;
}

// Where a disk left the field `wrap` and came in again opposite, the line is broken.
function lineOf(track, x, y, wrap) {
  const jumps = (a, b) => wrap && [0, 1].some((axis) => Math.abs(a[axis] - b[axis]) > (wrap[2 + axis] - wrap[axis]) / 2);
  return track.map((point, k) => {
    const goes = k && !jumps(track[k - 1], point) ? "L" : "M";
    return `${goes}${x.place(point[0]).toFixed(1)},${y.place(point[1]).toFixed(1)}`;
  }).join("");
}

function drawSurroundings(inside, pack, x, y) {
  for (const [x0, y0, x1, y1] of pack.walls) {
    inside.append(drawing("line", { class: "wall", x1: x.place(x0), y1: y.place(y0), x2: x.place(x1), y2: y.place(y1) }));
  }
  pack.radius.forEach((radius, disk) => {
    if (!pack.static[disk]) return;
    const [px, py] = [0, 1].map((axis) => placeOf(pack, pack.layers[0], 0, disk, axis));
    inside.append(drawing("circle", { class: "wall", cx: x.place(px), cy: y.place(py), r: radius * x.scale }));
  });
}

// From the units of the two axes to px in the frame; a path has the same scale across and up.
function scalesOf({ axes, box: [x0, y0, x1, y1] }, across, up) {
  const room = 1.1;
  let [width, height] = [x1 - x0, room * (y1 - y0) || 1];
  if (axes === "path") {
    const scale = Math.min(across / width, up / height) / room;
    [width, height] = [across / scale, up / scale];
  }
  const [left, high] = [(x0 + x1 - width) / 2, (y0 + y1 + height) / 2];
  return [
    { from: left, to: left + width, scale: across / width, place: (v) => (v - left) * across / width },
    { from: high - height, to: high, scale: up / height, place: (v) => (high - v) * up / height },
  ];
}

function drawAxesOf(picture, titles, x, y) {
  const { width, height, left, right, top, bottom } = FRAME;
  const [end, foot] = [width - right, height - bottom];
  picture.append(drawing("path", { class: "frame", d: `M${left},${top}V${foot}H${end}` }));
  for (const value of ticksOf(x)) {
    const at = left + x.place(value);
    picture.append(drawing("path", { class: "frame", d: `M${at},${foot}v3` }));
    picture.append(drawing("text", { x: at, y: foot + 14, "text-anchor": "middle" }, inShort(value)));
  }
  for (const value of ticksOf(y)) {
    const at = top + y.place(value);
    picture.append(drawing("path", { class: "frame", d: `M${left},${at}h-3` }));
    picture.append(drawing("text", { x: left - 5, y: at + 4, "text-anchor": "end" }, inShort(value)));
  }
  picture.append(drawing("text", { x: end, y: height - 4, "text-anchor": "end" }, titles[0]));
  picture.append(drawing("text", { x: 2, y: 11 }, titles[1]));
}

// Four or so, 1, 2 or 5 times a power of ten apart.
function ticksOf({ from, to }) {
  const least = (to - from) / 4.5, unit = 10 ** Math.floor(Math.log10(least));
  const step = unit * [1, 2, 5, 10].find((k) => k * unit >= least);
  const [first, last] = [Math.ceil(from / step - 1e-9), Math.floor(to / step + 1e-9)];
  return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
}

const inShort = (value) => String(Number(value.toPrecision(6))).replace("-", "−");

if (document.getElementById("panels")) openPanels(document.getElementById("panels"));

"use strict";
// Line charts as SVG: two axes, a grid, and the curves of the engines in their colours.

const SIZE = { width: 520, height: 290, left: 62, right: 12, top: 10, bottom: 42 };
const LETTER = 10;  // of an axis, at most: on a narrow page, where they are largest
const LINE = 16;  // height of a line of text, at most
const EMPTY = 1e-16;  // what is 0 stands at the foot of a logarithmic axis
const svg = (name, attributes, text) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
};

class Axis {
  constructor(values, log, from, to) {
    Object.assign(this, { log, from, to });
    const finite = values.filter((v) => Number.isFinite(v) && (!log || v > EMPTY));
    let low = Math.min(...finite), high = Math.max(...finite);
    if (!finite.length) [low, high] = log ? [EMPTY, 1] : [0, 1];
    if (log) [low, high] = [Math.log10(low), Math.log10(high)];
    this.counts = !log && finite.every(Number.isInteger);
    if (high - low < 1e-12 * Math.max(Math.abs(high), 1)) [low, high] = [low - 0.5, high + 0.5];
    const room = log ? 0.05 * (high - low) : 0.06 * (high - low);
    this.foot = log && values.some((v) => v <= EMPTY) ? 2 * room : 0;  // what is 0 has a place of its own below
    Object.assign(this, { low: low - room - this.foot, high: high + room });
  }

  place(value) {
    if (this.foot && value <= EMPTY) return this.from + 0.25 * this.foot / (this.high - this.low) * (this.to - this.from);
    const v = this.log ? Math.log10(Math.max(value, EMPTY)) : value;
    const share = (v - this.low) / (this.high - this.low);
    return this.from + Math.max(-0.02, Math.min(1.02, share)) * (this.to - this.from);
  }

  ticks() {
    const span = this.high - this.low;
    const step = this.log ? Math.max(1, Math.ceil(span / 6)) : Math.max(niceStep(span / 5), this.counts ? 1 : 0);
    const first = Math.ceil(this.low / step - 1e-9) * step;
    const found = [];
    for (let v = first; v <= this.high + 1e-9 * span; v += step) if (v >= this.low + this.foot && !(this.foot && 10 ** v <= EMPTY)) found.push(Math.abs(v) < 1e-9 * step ? 0 : v);
    // enough digits to tell two neighbours apart
    const digits = Math.max(3, Math.ceil(Math.log10(Math.max(...found.map(Math.abs), step) / step)) + 1);
    const numbers = this.log && found.length < 2 ? this.withinADecade() : found.map((v) => this.log ? [10 ** v, power(v)] : [v, short(v, digits)]);
    return this.foot ? [[0, "0"], ...numbers] : numbers;
  }

  // 1, 2 and 5 times powers of ten; where even these are too far apart, the ends.
  withinADecade() {
    const [first, last] = [Math.floor(this.low + this.foot), Math.ceil(this.high)];
    const decades = Array.from({ length: last - first + 1 }, (_, k) => first + k);
    const found = decades.flatMap((v) => [1, 2, 5].map((k) => k * 10 ** v)).filter((v) => Math.log10(v) >= this.low + this.foot && Math.log10(v) <= this.high);
    const values = found.length < 2 ? [10 ** (this.low + this.foot), 10 ** this.high] : [...new Set(found)];
    return values.map((v) => [v, short(v)]);
  }
}

function niceStep(wanted) {
  const unit = 10 ** Math.floor(Math.log10(wanted));
  return unit * [1, 2, 5, 10].find((k) => k * unit >= wanted);
}

const power = (v) => v >= -3 && v <= 3 ? short(10 ** v) : `10${String(Math.round(v)).replace(/[-\d]/g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)])}`;
const short = (v, digits = 3) => (v !== 0 && (Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5) ? v.toExponential(1) : String(Number(v.toPrecision(digits)))).replace("-", "−");

function drawChart(chart) {
  const figure = document.createElement("figure");
  const caption = document.createElement("figcaption");
  caption.textContent = chart.title;
  const { width, height, left, right, top, bottom } = SIZE;
  const picture = svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${chart.title}: ${chart.y} against ${chart.x}` });
  const [from, to] = chart.reverse ? [width - right, left] : [left, width - right];
  const x = new Axis(chart.curves.flatMap((curve) => curve.x), chart.log.includes("x"), from, to);
  const y = new Axis(chart.curves.flatMap((curve) => curve.y), chart.log.includes("y"), height - bottom, top);
  drawAxes(picture, chart, x, y);
  const clip = `clip-${Math.round(performance.now() * 1e3)}-${Math.floor(Math.random() * 1e9)}`;
  picture.append(svg("clipPath", { id: clip }));
  picture.lastChild.append(svg("rect", { x: left - 4, y: top - 4, width: width - left - right + 8, height: height - top - bottom + 8 }));
  const guides = chart.guides.map(([axis, value, text]) => [axis, axis === "x" ? x.place(value) : y.place(value), text]);
  for (const [axis, place] of guides) drawGuide(picture, axis, place);
  chart.curves.forEach((curve, k) => drawCurve(picture, curve, x, y, [k, chart.curves.length], clip));
  nameGuides(picture, guides, chart.curves.map((curve) => curve.x.map((each, j) => [x.place(each), y.place(curve.y[j])])));
  figure.append(caption, picture, savesOf(chart, picture));
  return figure;
}

function drawAxes(picture, chart, x, y) {
  const { width, height, left, right, top, bottom } = SIZE;
  for (const [value, text] of x.ticks()) {
    picture.append(svg("line", { class: "grid", x1: x.place(value), x2: x.place(value), y1: top, y2: height - bottom }));
    picture.append(svg("text", { class: "axis", x: x.place(value), y: height - bottom + 16, "text-anchor": "middle" }, text));
  }
  const numbers = y.ticks();
  for (const [value, text] of numbers) {
    picture.append(svg("line", { class: "grid", x1: left, x2: width - right, y1: y.place(value), y2: y.place(value) }));
    picture.append(svg("text", { class: "axis", x: left - 7, y: y.place(value) + 4, "text-anchor": "end" }, text));
  }
  picture.append(svg("text", { class: "axis", x: (left + width - right) / 2, y: height - 6, "text-anchor": "middle" }, chart.x));
  // long numbers push the title out to the left, and the picture is as much wider
  const longest = Math.max(...numbers.map(([, text]) => text.length));
  const title = Math.min(LINE, left - 7 - LETTER * longest - 7);
  picture.setAttribute("viewBox", `${title - LINE} 0 ${width + LINE - title} ${height}`);
  picture.append(svg("text", { class: "axis", x: -(top + height - bottom) / 2, y: title, transform: "rotate(-90)", "text-anchor": "middle" }, chart.y));
}

// A line across.
function drawGuide(picture, axis, place) {
  const { width, height, left, right, top, bottom } = SIZE;
  const ends = axis === "x" ? { x1: place, x2: place, y1: top, y2: height - bottom } : { x1: left, x2: width - right, y1: place, y2: place };
  picture.append(svg("line", { class: "guide", ...ends }));
}

// Their texts, over all lines: that of a line upwards is beside it, in the lowest row that no curve crosses there.
function nameGuides(picture, guides, curves) {
  const { width, height, right, bottom } = SIZE;
  const taken = new Set();
  for (const [axis, place, text] of guides) {
    const late = axis === "y" || place > width / 2;
    const at = { x: width - right - 4, y: place - 5 };
    if (axis === "x") {
      const far = 5 + LETTER * text.length;
      at.x = place + (late ? -5 : 5);
      at.y = freeRow(late ? [place - far, place] : [place, place + far], curves, taken) ?? height - bottom - 6 - LINE * taken.size;
      taken.add(at.y);
    }
    picture.append(svg("text", { class: "axis over", ...at, "text-anchor": late ? "end" : "start" }, text));
  }
}

// The foot of the lowest row of text from x `from` to `to` that is not taken and that no curve crosses.
function freeRow([from, to], curves, taken) {
  const { height, top, bottom } = SIZE;
  const crossed = curves.flatMap((points) => points.slice(1).map((end, j) => heights(points[j], end, from, to))).filter((each) => each);
  const rows = Array.from({ length: Math.floor((height - top - bottom) / LINE) }, (_, k) => height - bottom - 6 - LINE * k);
  return rows.find((row) => !taken.has(row) && crossed.every(([low, high]) => high < row - LINE || low > row + 6));
}

// Least and largest y of a line from a to b between x `from` and `to`; null where it does not come.
function heights(a, b, from, to) {
  const [[x1, y1], [x2, y2]] = a[0] <= b[0] ? [a, b] : [b, a];
  if (!(x2 >= from && x1 <= to) || !Number.isFinite(y1 + y2)) return null;
  const at = (x) => x2 > x1 ? y1 + (y2 - y1) * (Math.max(x1, Math.min(x2, x)) - x1) / (x2 - x1) : y1;
  const ends = x2 > x1 ? [at(from), at(to)] : [y1, y2];
  return [Math.min(...ends), Math.max(...ends)];
}

// The lower a curve lies, the wider are its line and its marks, so that those that coincide stay visible under each other.
function drawCurve(picture, curve, x, y, [k, count], clip) {
  const look = looks[curve.name];
  const colour = look[darkPage() ? "dark" : "light"];
  const above = Math.min(count - k - 1, 5);
  const points = curve.x.map((each, j) => [x.place(each), y.place(curve.y[j])]);
  const path = points.map(([px, py], j) => `${j ? "L" : "M"}${px.toFixed(1)},${py.toFixed(1)}`).join("");
  const width = curve.name === "truth" ? 1.3 : 1.5 + 0.7 * above;
  const group = svg("g", { class: curve.faint ? "of faint" : "of", "data-name": curve.name });
  group.append(svg("title", {}, nameOf(curve.name)));
  group.append(svg("path", { class: "near", d: path, "clip-path": `url(#${clip})` }));
  group.append(svg("path", { class: "curve", d: path, stroke: colour, "stroke-width": width, "stroke-dasharray": look.dash.join(","), "clip-path": `url(#${clip})` }));
  for (const [px, py] of curve.dots ? points : marked(curve, points, k / count)) {
    const size = curve.dots ? 1 + 0.3 * above : 1;
    group.append(svg("path", { class: "mark", d: look.path, transform: `translate(${px.toFixed(1)},${py.toFixed(1)}) scale(${size})`, fill: look.filled ? colour : "var(--page)", stroke: colour, "stroke-width": 1.2 / size }));
  }
  group.addEventListener("pointerenter", () => raise(curve.name));
  group.addEventListener("pointerleave", () => raise(null));
  picture.append(group);
}

// Some points of a line, each curve's at places of its own (`share` of the way between two), so that marks of curves
// that coincide lie side by side. The exact answer has none: it is the thin line on top.
function marked(curve, points, share) {
  const marks = curve.faint ? 3 : 6;
  if (curve.name === "truth" || points.length < marks) return [];
  const [from, to] = [points[0][0], points[points.length - 1][0]];
  return Array.from({ length: marks }, (_, j) => from + (to - from) * (j + 0.1 + 0.8 * share) / marks)
    .map((wanted) => points.reduce((best, each) => Math.abs(each[0] - wanted) < Math.abs(best[0] - wanted) ? each : best));
}

// Brings the curves of that name to the top in all charts and lets the others fade; null: all as they were.
function raise(name) {
  for (const picture of document.querySelectorAll(".curves svg")) {
    picture.classList.toggle("raised", name !== null && picture.querySelector(`[data-name="${CSS.escape(name)}"]`) !== null);
    for (const group of picture.querySelectorAll(".of")) group.classList.toggle("top", group.dataset.name === name);
    const groups = [...picture.querySelectorAll(".of")];
    groups.forEach((group, k) => { group.dataset.order ??= k; });
    const order = (group) => group.dataset.name === name ? groups.length : Number(group.dataset.order);
    const sorted = [...groups].sort((one, other) => order(one) - order(other));
    // The group under the pointer stays where it is in the document, or the browser would say that the pointer left it.
    for (const group of sorted) if (!group.matches(":hover")) {
      const hovered = groups.find((each) => each.matches(":hover"));
      hovered ? hovered.before(group) : picture.append(group);
    }
    picture.append(...picture.querySelectorAll(".over"));
  }
  for (const item of document.querySelectorAll(".names li")) item.classList.toggle("top", item.dataset.name === name);
}

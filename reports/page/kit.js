"use strict";
// A page of sections: replays with the engines to choose from, rows that open, addresses that open them, tables that
// sort, code to copy, paper.

const looks = JSON.parse(document.getElementById("looks")?.textContent ?? "{}");
const darkness = matchMedia("(prefers-color-scheme: dark)");
let onPaper = false;
const darkPage = () => darkness.matches && !onPaper;
const SEEN = 3;  // px: a difference that the eye sees, in a picture of 370 x 290 px
const packed = Object.fromEntries([...document.querySelectorAll("script[data-opens]")].map((script) => [script.dataset.opens, script]));

function make(kind, css, ...children) {
  const element = Object.assign(document.createElement(kind), { className: css });
  element.append(...children);
  return element;
}

const short = (value) => value < 1e-6 ? "0" : String(Number(value.toPrecision(2)));

function swatch(name) {
  const [svg, use] = ["svg", "use"].map((kind) => document.createElementNS("http://www.w3.org/2000/svg", kind));
  const k = Object.keys(looks).indexOf(name);
  svg.setAttribute("class", `swatch k${k}`);
  use.setAttribute("href", `#k${k}`);
  svg.append(use);
  return svg;
}

// A player with its pictures, the engines to choose from, and where they part from the exact answer.
class Replay extends Player {
  constructor(element, pack) {
    super(element, pack, looks);
    this.truth = pack.layers.find((layer) => layer.name === "truth");
    this.names = pack.layers.map((layer) => layer.name).filter((name) => !pack.panels || name !== "truth");
    this.ticked = new Set(pack.ticked ?? this.names);
    this.first = pack.panels && this.truth ? this.findFirst() : {};
    for (const name of this.names.length > 1 ? this.names : []) {
      const box = Object.assign(make("input", ""), { type: "checkbox", checked: this.ticked.has(name), value: name });
      box.onchange = () => { this.ticked[box.checked ? "add" : "delete"](name); this.layOut(); };
      element.querySelector(".chips").append(make("label", "", box, swatch(name), ` ${this.label(name)} `, make("small", "", pack.errors?.[name] ?? "")));
    }
    this.layOut();
    if (!pack.opens && pack.panels) this.seek(this.opens());
  }

  // The first frame in which a disk of each engine is visibly off; -1 if none is.
  findFirst() {
    const { pack, truth } = this, [left, bottom, right, top] = pack.view;
    const seen = SEEN / Math.min(370 / (right - left), 290 / (top - bottom));
    const place = (layer, frame, disk) => [0, 1].map((axis) => placeOf(pack, layer, frame, disk, axis));
    const off = (layer, frame) => pack.radius.some((_, disk) => this.distance(place(layer, frame, disk), place(truth, frame, disk)) > seen);
    const first = (layer) => pack.t.findIndex((_, frame) => frame < Math.min(layer.frames, truth.frames) && off(layer, frame));
    return Object.fromEntries(pack.layers.map((layer) => [layer.name, first(layer)]));
  }

  // The ticked engines that part from the exact answer, the first one first.
  get parting() { return [...this.ticked].filter((name) => this.first[name] >= 0).sort((a, b) => this.first[a] - this.first[b]); }

  // s, just after the first visible difference of what is ticked, else the end of the exact answer.
  opens() {
    const { t } = this.pack, last = this.truth ? this.truth.frames - 1 : t.length - 1, [name] = this.parting;
    return t[name ? Math.min(this.first[name] + 1, last) : last];
  }

  layOut() {
    const { pack, element } = this;
    const shown = pack.panels ? this.names.filter((name) => this.ticked.has(name)) : [null];
    this.panels = shown.map((name) => {
      const canvas = Object.assign(make("canvas", ""), { role: "img", ariaLabel: name ? `${this.label(name)} over the exact answer` : element.ariaLabel });
      const picture = make("div", "picture", canvas);
      if (!name) return { canvas, figure: picture };
      const off = make("span", "off");
      const title = make("figcaption", "", swatch(name), make("b", "", this.label(name)), make("small", "", pack.notes?.[name] ?? ""), off);
      return { canvas, name, off, figure: make("figure", "panel", title, picture, make("p", "bad", pack.words?.[name] ?? "")) };
    });
    element.querySelector(".pictures").replaceChildren(...this.panels.map((panel) => panel.figure));
    element.classList.toggle("panels", Boolean(pack.panels));
    this.hidden = new Set(this.names.filter((name) => !this.ticked.has(name)));
    this.look(this.panels);
    this.fit();
    if (pack.panels) this.mark();
  }

  // Says where the ticked engines part from the exact answer, and marks it above the slider.
  mark() {
    const { t, asks } = this.pack, { truth, parting, first } = this;
    this.element.querySelectorAll(".track i").forEach((tick) => tick.remove());
    for (const name of parting) {
      const tick = Object.assign(make("i", ""), { title: `${this.label(name)} is visibly off from here on` });
      tick.style.left = `${100 * (t[first[name]] - t[0]) / (t.at(-1) - t[0])}%`;
      tick.style.background = `var(--${looks[name].light.slice(1)},${looks[name].light})`;
      this.element.querySelector(".track").append(tick);
    }
    const difference = parting.length ? `First visible difference: ${this.label(parting[0])} after ${short(t[first[parting[0]]])} s.`
      : truth ? "No visible difference between what is ticked." : "";
    const end = !truth ? "This scene has no exact answer." : truth.ends ? `Grey: the exact answer, known up to ${truth.ends} of ${short(t.at(-1))} s.` : "Grey: the exact answer.";
    this.element.querySelector(".says").textContent = [asks, difference, end].filter(Boolean).join(" ");
  }

  // And how far each panel's engine is off now.
  draw() {
    super.draw();
    if (!this.truth || !this.pack.panels) return;
    const exact = this.positions("truth"), { radius } = this.pack;
    for (const { name, off } of this.panels ?? []) {
      const places = this.positions(name);
      const worst = exact && places && Math.max(...places.map((place, disk) => this.distance(place, exact[disk]) / radius[disk]));
      off.textContent = !exact ? "after the exact answer" : !places ? "ended" : worst < 0.015 ? "< 0.015 radii off" : `${short(worst)} radii off`;
    }
  }
}

// Starts the replays in `root` that can be seen.
async function startReplays(root) {
  for (const element of root.querySelectorAll(".replay:not([data-started])")) {
    if (element.closest("details:not([open])")) continue;
    element.dataset.started = "";
    const pack = readPack(await inflate(element.querySelector(".pack").textContent));
    players[pack.key ?? Object.keys(players).length + 1] = new Replay(element, pack);
  }
}

async function openRow(row, open = row.nextElementSibling?.className !== "opened") {
  const shown = row.nextElementSibling?.className === "opened" ? row.nextElementSibling : null;
  row.querySelector("button.open").setAttribute("aria-expanded", open);
  if (!open) shown?.remove();
  if (!open || shown) return;
  const cell = Object.assign(make("td", ""), { colSpan: row.closest("table").querySelector("colgroup").children.length });
  row.after(make("tr", "opened", cell));
  if (!window.DecompressionStream) {
    cell.textContent = "This browser cannot unpack the row; any browser since 2023 can.";
    return;
  }
  cell.innerHTML = new TextDecoder().decode(await inflate(packed[row.id].textContent));
  begin(cell);
  await startReplays(cell);
}

// Opens what the address names: a row, or a section that is folded.
async function follow() {
  const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  if (target.matches("tr.opens")) await openRow(target, true);
  target.scrollIntoView({ block: "start" });
}

// A heading sorts the rows by its column; a text leaves those that contain it.
function sortable(table) {
  const order = new Intl.Collator(undefined, { numeric: true }).compare;
  const rows = [...table.tBodies[0].rows], headings = [...table.tHead.rows].at(-1).cells;
  const close = () => table.querySelectorAll("tr.opened").forEach((row) => row.remove());
  [...headings].forEach((heading, column) => {
    heading.querySelector("button").onclick = () => {
      const down = heading.getAttribute("aria-sort") === "ascending";
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", down ? "descending" : "ascending");
      close();
      const text = (row) => row.cells[column].textContent.trim();
      table.tBodies[0].append(...rows.sort((a, b) => (down ? -1 : 1) * order(text(a), text(b))));
    };
  });
  const filter = table.closest(".scroll").previousElementSibling;
  filter.querySelector("input").oninput = ({ target }) => {
    const text = target.value.toLowerCase();
    const holds = (row) => [row.textContent, ...[...row.querySelectorAll("[title]")].map((cell) => cell.title)].join("\n").toLowerCase().includes(text);
    close();
    for (const row of rows) row.hidden = !holds(row);
    filter.querySelector("output").value = text ? `${rows.filter((row) => !row.hidden).length} of ${rows.length}` : "";
  };
}

function begin(root) {
  root.querySelectorAll("button.open").forEach((button) => { button.onclick = () => openRow(button.closest("tr")); });
  root.querySelectorAll("button.copy").forEach((button) => {
    button.onclick = () => {
      navigator.clipboard?.writeText(button.closest(".code").querySelector("pre").textContent);
      button.textContent = "copied";
    };
  });
  root.querySelectorAll("table.sortable").forEach(sortable);
  root.querySelectorAll("details").forEach((fold) => fold.addEventListener("toggle", () => startReplays(fold)));
}

// On paper: the paths, and the disks at their ends; pictures side by side stay at their first difference.
function print(begins) {
  onPaper = begins;
  for (const player of Object.values(players)) {
    if (player.pack.panels) player.draw();
    else player.seek(begins ? player.until : player.time);
  }
}

darkness.addEventListener("change", () => Object.values(players).forEach((player) => player.draw()));
addEventListener("beforeprint", () => print(true));
addEventListener("afterprint", () => print(false));
addEventListener("hashchange", follow);
begin(document);
startReplays(document).then(follow);

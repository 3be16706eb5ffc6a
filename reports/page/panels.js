"use strict";
// A replay of a page of sections: its pictures, the engines to choose from, and where they part from the exact answer.

const looks = JSON.parse(document.getElementById("looks")?.textContent ?? "{}");
const darkness = matchMedia("(prefers-color-scheme: dark)");
let onPaper = false;
const darkPage = () => darkness.matches && !onPaper;
const SEEN = 3;  // px: a difference that the eye sees, in a picture of 370 x 290 px

function make(kind, css, ...children) {
  const element = Object.assign(document.createElement(kind), { className: css });
  element.append(...children);
  return element;
}

function short(value) { return value < 1e-6 ? "0" : String(Number(value.toPrecision(2))); }

class Replay {
  constructor(element, pack) {
    this.element = element;
    this.truth = pack.layers.find((layer) => layer.name === "truth");
    this.names = pack.layers.map((layer) => layer.name).filter((name) => !pack.panels || name !== "truth");
    this.ticked = new Set(pack.ticked ?? this.names);
    this.player = new Player(element, pack, looks);
    if (pack.panels && this.truth) this.findFirst();
    if (this.names.length > 1) this.addChips();
    this.layOut();
    if (!pack.opens && pack.panels) this.player.seek(this.opens());
    const draw = this.player.draw.bind(this.player);
    this.player.draw = () => { draw(); this.measure(); };
    this.player.fit();
  }

  // The first frame in which a disk of each engine is visibly off; -1 if none is.
  findFirst() {
    const { pack } = this.player, [left, bottom, right, top] = pack.view;
    const seen = SEEN / Math.min(370 / (right - left), 290 / (top - bottom));
    const place = (layer, frame, disk) => [0, 1].map((axis) => placeOf(pack, layer, frame, disk, axis));
    const off = (layer, frame) => pack.radius.some((_, disk) => this.player.distance(place(layer, frame, disk), place(this.truth, frame, disk)) > seen);
    this.first = Object.fromEntries(pack.layers.map((layer) => {
      const frames = Array.from({ length: Math.min(layer.frames, this.truth.frames) }, (_, k) => k);
      return [layer.name, frames.findIndex((frame) => off(layer, frame))];
    }));
  }

  // s, just after the first visible difference of what is ticked, else the end of the exact answer.
  opens() {
    const { t } = this.player.pack, frames = [...this.ticked].map((name) => this.first?.[name] ?? -1).filter((k) => k >= 0);
    const last = this.truth ? this.truth.frames - 1 : t.length - 1;
    return t[frames.length ? Math.min(Math.min(...frames) + 1, last) : last];
  }

  addChips() {
    const { pack } = this.player;
    for (const name of this.names) {
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: this.ticked.has(name), value: name });
      box.onchange = () => { box.checked ? this.ticked.add(name) : this.ticked.delete(name); this.layOut(); };
      const label = make("label", "", box, swatch(name), ` ${this.player.label(name)} `, make("small", "", pack.errors?.[name] ?? ""));
      this.element.querySelector(".chips").append(label);
    }
  }

  layOut() {
    const { player } = this, { pack } = player;
    const shown = pack.panels ? this.names.filter((name) => this.ticked.has(name)) : [null];
    this.panels = shown.map((name) => {
      const canvas = Object.assign(document.createElement("canvas"), { role: "img" });
      canvas.setAttribute("aria-label", name ? `${player.label(name)} over the exact answer` : this.element.getAttribute("aria-label"));
      const picture = make("div", "picture", canvas);
      if (!name) return { canvas, figure: picture };
      const off = make("span", "off");
      const title = make("figcaption", "", swatch(name), make("b", "", player.label(name)), make("small", "", pack.notes?.[name] ?? ""), off);
      return { canvas, name, off, figure: make("figure", "panel", title, picture, make("p", "bad", pack.words?.[name] ?? "")) };
    });
    this.element.querySelector(".pictures").replaceChildren(...this.panels.map((panel) => panel.figure));
    this.element.classList.toggle("panels", Boolean(pack.panels));
    player.hidden = new Set(this.names.filter((name) => !this.ticked.has(name)));
    player.look(this.panels.map(({ canvas, name }) => ({ canvas, name })));
    player.fit();
    if (pack.panels) this.mark();
  }

  // Says where the ticked engines part from the exact answer, and marks it above the slider.
  mark() {
    const { pack } = this.player, { t } = pack, track = this.element.querySelector(".track");
    track.querySelectorAll("i").forEach((tick) => tick.remove());
    const parts = [...this.ticked].filter((name) => this.first?.[name] >= 0).sort((a, b) => this.first[a] - this.first[b]);
    for (const name of parts) {
      const tick = Object.assign(document.createElement("i"), { title: `${this.player.label(name)} is visibly off from here on` });
      tick.style.left = `${100 * (t[this.first[name]] - t[0]) / (t.at(-1) - t[0])}%`;
      tick.style.background = `var(--${looks[name].light.slice(1)},${looks[name].light})`;
      track.append(tick);
    }
    const difference = parts.length ? `First visible difference: ${this.player.label(parts[0])} after ${short(t[this.first[parts[0]]])} s.`
      : this.truth ? "No visible difference between what is ticked." : "";
    const end = !this.truth ? "This scene has no exact answer." : this.truth.ends ? `Grey: the exact answer, known up to ${this.truth.ends} of ${short(t.at(-1))} s.` : "Grey: the exact answer.";
    this.element.querySelector(".says").textContent = [pack.asks, difference, end].filter(Boolean).join(" ");
    this.measure();
  }

  // How far each panel's engine is off now.
  measure() {
    const { player, truth } = this;
    if (!truth || !player.pack.panels) return;
    const exact = player.positions("truth");
    for (const { name, off } of this.panels) {
      const mine = player.positions(name);
      const worst = exact && mine && Math.max(...mine.map((place, disk) => player.distance(place, exact[disk]) / player.pack.radius[disk]));
      off.textContent = !exact ? "after the exact answer" : !mine ? "ended" : worst < 0.015 ? "< 0.015 radii off" : `${short(worst)} radii off`;
    }
  }
}

function swatch(name) {
  const k = Object.keys(looks).indexOf(name);
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("class", `swatch k${k}`);
  const use = document.createElementNS("http://www.w3.org/2000/svg", "use");
  use.setAttribute("href", `#k${k}`);
  svg.append(use);
  return svg;
}

// Starts the replays in `root` that can be seen.
async function startReplays(root) {
  for (const element of root.querySelectorAll(".replay:not([data-started])")) {
    if (element.closest("details:not([open])")) continue;
    element.dataset.started = "";
    const pack = readPack(await inflate(element.querySelector(".pack").textContent));
    const replay = new Replay(element, pack);
    players[pack.key ?? Object.keys(players).length + 1] = replay.player;
  }
}

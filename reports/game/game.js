"use strict";
// The page of the game: asks the server for every frame, sends the keys, shows what the engines have.

const MOST_FRAMES = 4;  // asked for at once, as the server allows
const KEYS = { w: "w", a: "a", s: "s", d: "d", ArrowUp: "w", ArrowLeft: "a", ArrowDown: "s", ArrowRight: "d" };
const by = (id) => document.getElementById(id);

class Game {
  constructor() {
    this.sky = new Field(by("sky"));
    this.rows = [...document.querySelectorAll("tr[data-engine]")];
    this.chosen = document.querySelector("[name=solid]:checked").value;  // solid when a flight begins
    Object.assign(this, { field: null, frames: [], waiting: 0, owed: 0, paused: reducedMotion.matches, down: new Set(), stopped: new Set(), gone: new Set(), pace: [], drawn: [] });
    this.listen();
    this.connect();
    requestAnimationFrame((now) => this.tick(now));
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/fly`);
    this.socket.onopen = () => { this.say(this.field ? "" : "Starting the engines. The first start compiles them, which takes a while …"); if (this.field) this.begin(); };
    this.socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    this.socket.onclose = (event) => {
      this.say(`${event.reason || "The server does not answer"}. Trying again …`);
      this.waiting = 0;
      setTimeout(() => this.connect(), 2000);
    };
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  hear(message) {
    if (message.kind === "field") this.open(message);
    else if (message.kind === "frame") this.arrive(message);
    else if (message.kind === "file") this.download(message);
    else { this.waiting = 0; this.announce(message.text); }
  }

  open(field) {
    if (field.server && field.server !== document.body.dataset.server) { location.reload(); return; }  // started anew: other engines, or another flight
    Object.assign(this, { field, frames: [field.first, field.first], waiting: 0, owed: 0 });
    this.stopped.clear();
    this.gone.clear();
    this.say("");
    this.sky.begin(field);
    this.showPaused();
    this.nameThoseWhoLeave(field.first);
    this.show();
  }

  arrive(frame) {
    this.frames = [this.frames[1], frame];
    this.arrived = performance.now();
    this.span = (frame.frame - this.frames[0].frame) * this.field.interval * 1000;
    recent(this.pace, [this.arrived, frame.ms, frame.t]);
    this.waiting = 0;
    this.stopWhereTheyPart(frame);
    this.nameThoseWhoLeave(frame);
    this.show();
  }

  stopWhereTheyPart(frame) {
    const diverged = this.field.engines.filter((name, k) => frame.flyers[k].diverged && !this.stopped.has(name));
    diverged.forEach((name) => this.stopped.add(name));
    if (diverged.length && by("stop").checked) this.pause(true);
  }

  nameThoseWhoLeave(frame) {
    const left = this.field.engines.filter((name, k) => frame.flyers[k].left && !this.gone.has(name));
    left.forEach((name) => this.gone.add(name));
    const said = left.map((name) => `${shortName(name)} ${farewell(frame.flyers[this.field.engines.indexOf(name)])}`);
    if (frame.solid && left.includes(this.field.engines[this.frames[0].solid])) said.push(`${shortName(this.field.engines[frame.solid])} is solid from here on`);
    if (left.length) this.announce(said.join("; "));
  }

  tick(now) {
    const passed = Math.min(now - (this.before ?? now), 100);
    this.before = now;
    if (this.field && !this.paused && !this.now.over) {
      this.owed += passed / 1000 / this.field.interval;
      if (!this.waiting && this.owed >= 1) {
        const count = Math.min(MOST_FRAMES, Math.floor(this.owed));
        this.owed = Math.min(this.owed - count, MOST_FRAMES);
        this.ask(count);
      }
    }
    if (this.waiting && now - this.asked > 1000) this.tell("Waiting for the engines …");
    if (this.field && this.sky.size) this.draw(now);
    requestAnimationFrame((later) => this.tick(later));
  }

  get now() { return this.frames[1]; }

  ask(count) { this.wait(count); this.send({ do: "frames", count }); }

  wait(count) { Object.assign(this, { waiting: count, asked: performance.now() }); }

  // Between the last two frames that came, as far as time has gone on since: motion is smooth at any rate of the screen.
  draw(now) {
    const began = performance.now();
    const share = this.span ? Math.min(1, (now - this.arrived) / this.span) : 1;
    const [before, after] = this.frames;
    const flyers = after.flyers.map((flyer, k) => ({
      name: this.field.engines[k], label: shortName(this.field.engines[k]), gone: flyer.left,
      at: this.field.radius.map((_, disk) => this.between(before.flyers[k], flyer, disk, this.paused ? 1 : share)),
    }));
    const marks = after.flyers.flatMap((flyer, k) => this.marksOf(flyer, this.field.engines[k]));
    this.sky.draw(flyers, after.solid, after.force, marks);
    recent(this.drawn, [now, performance.now() - began]);
  }

  between(before, after, disk, share) {
    const mix = (a, b, span) => Math.abs(b - a) > span / 2 ? b : a + share * (b - a);  // half the field in a frame: it wrapped
    const [left, bottom, right, top] = this.field.wrap ?? [-Infinity, -Infinity, Infinity, Infinity];
    return [
      mix(before.x[2 * disk], after.x[2 * disk], right - left),
      mix(before.x[2 * disk + 1], after.x[2 * disk + 1], top - bottom),
      mix(before.angle[disk], after.angle[disk], Infinity),
    ];
  }

  // Where it diverged, and where its ship was when it left. Names only, so that labels leave the field free: the table says the rest.
  marksOf({ diverged, left_at: left, x: [x, y] }, name) {
    const marks = diverged ? [{ x: diverged.x, y: diverged.y, name, text: shortName(name) }] : [];
    return left ? [...marks, { x, y, name, text: `${shortName(name)} left` }] : marks;
  }

  show() {
    const frame = this.now;
    by("clock").textContent = `${frame.t.toFixed(2)} s`;
    for (const row of this.rows) {
      const k = this.field.engines.indexOf(row.dataset.engine);
      row.classList.toggle("off", k < 0);
      row.classList.toggle("solid", k === frame.solid);
      if (k === frame.solid) row.querySelector("[name=solid]").checked = true;
      this.fill(row, frame.flyers[k], k === frame.solid);
    }
    const banner = by("banner");
    banner.classList.toggle("won", frame.won);
    if (frame.won) this.tell("You won");
    else if (frame.over) this.tell(this.field.replayed ? "The flight ends here" : "The flight is over");
    else if (frame.set_back && frame.t - frame.set_back.t < 3) this.tell(`The ship left the field: back to the ${frame.set_back.beside ? "free place nearest to the start, which is taken" : "start"}`);
    else if (this.paused) this.tell(frame.frame ? "Paused" : "P starts the flight");
    else this.tell("");
    this.showPace(frame);
  }

  fill(row, flyer, solid) {
    const cell = (name) => row.querySelector(`[data-cell=${name}]`);
    const put = (name, text) => { if (cell(name).textContent !== text) cell(name).textContent = text; };
    const flies = flyer && !flyer.left;
    put("momentum", flies ? vector(flyer.momentum) : "");
    put("energy", flies ? figure(flyer.energy) : "");
    put("ship_deviation", flies && !solid ? figure(flyer.ship_deviation) : "");
    put("deviation", flies && !solid ? figure(flyer.deviation) : "");
    put("collisions", flyer ? String(flyer.collisions) : "");
    put("diverged", flyer ? this.story(flyer, row.dataset.engine) : "");
    cell("diverged").classList.toggle("gone", Boolean(flyer?.left));
  }

  story(flyer, name) {
    if (flyer.left) return farewell(flyer);
    const { solid, solid_since: since } = this.now;
    const told = flyer.diverged ? [this.divergence(flyer.diverged, solid)] : [];
    if (since && name === this.field.engines[solid]) told.push(`solid since ${since.toFixed(2)} s, when ${shortName(this.lastSolid())} left`);
    return told.join("; ");
  }

  // The one that the solid one took over from.
  lastSolid() {
    const { flyers, solid, solid_since: since } = this.now;
    return this.field.engines[flyers.slice(0, solid).findLastIndex((flyer) => flyer.left_at === since)];
  }

  divergence({ t, disks: [i, j], solid, only }, now) {
    const from = solid === this.field.engines[now] ? "" : `, beside ${shortName(solid)}`, at = `${t.toFixed(2)} s: `;
    if (i === undefined) return `${at}the ship leaves the field in ${shortName(only)} only${from}`;
    if (j === undefined) return `${at}${bodyOf(i)} gets another velocity without a collision${from}`;
    return `${at}${pairOf(i, j)} collide in ${only ? `${shortName(only)} only` : "both"}${from}`;
  }

  // Over the last second; the flight is slowed where the engines, the way to the server or the screen are too slow.
  showPace(frame) {
    if (!frame.ms || this.pace.length < 2 || this.drawn.length < 2) return;
    const [a, b] = [this.pace[0], this.pace.at(-1)];
    const share = (b[2] - a[2]) / ((b[0] - a[0]) / 1000);
    const rate = (this.drawn.length - 1) / ((this.drawn.at(-1)[0] - this.drawn[0][0]) / 1000);
    const slowed = !this.paused && share > 0 && share < 0.95 ? `; the flight is slowed to ${(100 * share).toFixed(0)} %` : "";
    by("pace").textContent = `${rate.toFixed(0)} frames a second, ${mean(this.drawn).toFixed(1)} ms to draw one; the engines take ${mean(this.pace).toFixed(1)} ms a frame, of ${(this.field.interval * 1000).toFixed(1)} ms${slowed}`;
  }

  say(text) { clearTimeout(this.timer); this.message = text; this.tell(""); }

  announce(text) {
    this.say(text);
    this.timer = setTimeout(() => { this.message = ""; if (this.field) this.show(); }, 6000);
  }

  tell(text) {
    const shown = this.message || text;
    if (by("banner").textContent !== shown) by("banner").textContent = shown;
  }

  pause(on) { this.paused = on; this.owed = 0; this.showPaused(); if (this.field) this.show(); }

  showPaused() {
    by("pause").firstElementChild.textContent = this.paused ? "▶" : "❚❚";
    by("pause").setAttribute("aria-label", this.paused ? "fly on (P)" : "pause (P)");
  }

  step() { this.pause(true); if (!this.waiting && !this.now.over) this.ask(1); }

  begin() {
    const chosen = this.rows.map((row) => row.dataset.engine).filter((name) => this.box(name).checked);
    const engines = [this.chosen, ...chosen.filter((name) => name !== this.chosen)];
    const wishes = by("wishes") ? new FormData(by("wishes")) : new Map();
    if (by("wishes") && !by("wishes").reportValidity()) return;
    const numbers = Object.fromEntries([...wishes.entries()].map(([key, value]) => [key, Number(value)]));
    this.release();
    this.wait(1);
    this.send({ do: "fly", engines, ...numbers });
  }

  box(name) { return document.querySelector(`[name=flies][value="${CSS.escape(name)}"]`); }

  key(key, down) {
    if (down) this.down.add(key); else this.down.delete(key);
    document.querySelector(`[data-key=${key}]`)?.classList.toggle("on", down);
    this.send({ do: "key", key, down });
  }

  release() { [...this.down].forEach((key) => this.key(key, false)); }

  download({ name, text, cut, seconds }) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
    link.download = name;
    link.click();
    URL.revokeObjectURL(link.href);
    const until = cut ? `, up to ${seconds.toFixed(2)} s, where the ship first left the field` : "";
    this.announce(`Saved ${name}${until}: crosscheck run ${name}`);
  }

  listen() {
    window.addEventListener("keydown", (event) => this.pressed(event));
    window.addEventListener("keyup", (event) => { const key = keyOf(event); if (key && this.down.has(key)) this.key(key, false); });
    window.addEventListener("blur", () => this.release());  // a key that goes up elsewhere is not heard here
    by("pause").onclick = () => this.pause(!this.paused);
    by("step").onclick = () => this.step();
    by("again").onclick = () => this.begin();
    if (by("save")) by("save").onclick = () => this.send({ do: "save" });
    for (const button of document.querySelectorAll("[data-key]")) {
      button.addEventListener("pointerdown", (event) => { button.setPointerCapture(event.pointerId); this.key(button.dataset.key, true); });
      for (const end of ["pointerup", "pointercancel"]) button.addEventListener(end, () => this.key(button.dataset.key, false));
    }
    for (const box of document.querySelectorAll("[name=flies], [name=solid]")) box.onchange = () => this.choose(box);
    by("wishes")?.addEventListener("input", (event) => { const shown = event.target.parentElement.querySelector("output"); if (shown) shown.textContent = event.target.value; });
    by("wishes")?.addEventListener("change", () => this.begin());
    by("wishes")?.addEventListener("submit", (event) => { event.preventDefault(); this.begin(); });
  }

  // The solid one always flies.
  choose(box) {
    if (box.name === "solid") this.chosen = box.value;
    this.box(this.chosen).checked = true;
    box.blur();  // so that the keys steer again
    this.begin();
  }

  pressed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const writes = event.target.matches?.("input[type=number], select, input[type=range]");
    const key = keyOf(event);
    if (key && !(writes && event.key.length > 1) && by("wishes") && !event.target.matches?.("input[type=radio]")) {
      event.preventDefault();
      if (!event.repeat || key === "w" || key === "s") this.key(key, true);  // a repeated key aims anew, as in the exercise
    } else if (!writes) {
      const act = { p: () => this.pause(!this.paused), ".": () => this.step(), n: () => this.begin() }[event.key.toLowerCase()];
      if (act && !event.repeat) { event.preventDefault(); act(); }
    }
  }
}

const keyOf = (event) => KEYS[event.key] ?? KEYS[event.key.toLowerCase()];
const farewell = ({ left, left_at: at }) => at ? `left at ${at.toFixed(2)} s: ${left}` : `does not fly: ${left}`;
const bodyOf = (k) => k === SHIP ? "ship" : k < 0 ? `wall ${-1 - k}` : `disk ${k}`;
const pairOf = (i, j) => i === SHIP || j !== SHIP ? `${bodyOf(i)} and ${bodyOf(j)}` : pairOf(j, i);
const raised = (digits) => [...digits].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]).join("");

// Every number of the table has so many significant digits: more would only flicker. Below a millionth of a unit one is enough.
const DIGITS = 4;
const decimals = (value) => Math.max(0, DIGITS - 1 - Math.floor(Math.log10(Math.abs(value)) + 1e-9));
const rounded = (value) => Number(value.toPrecision(DIGITS));
const figure = (value) => {
  if (value === 0) return "0";
  if (Math.abs(value) >= 1e6 || Math.abs(value) < 1e-3) return power(value);
  return rounded(value).toFixed(decimals(rounded(value)));
};
const power = (value) => {
  const [digits, exponent] = value.toExponential(Math.abs(value) < 1e-6 ? 0 : DIGITS - 1).split("e");
  return `${digits}×10${exponent < 0 ? "⁻" : ""}${raised(exponent.replace(/[+-]/, ""))}`;
};
// As many decimals as the larger component has: what is left of the smaller one is no better known.
const vector = (pair) => {
  const largest = Math.max(...pair.map(Math.abs));
  if (largest < 1e-3 || largest >= 1e6) return pair.map(figure).join(", ");
  const place = decimals(rounded(largest));
  return pair.map((part) => (Number(part.toFixed(place)) || 0).toFixed(place)).join(", ");  // || 0: no -0
};
const labels = Object.fromEntries([...document.querySelectorAll("tr[data-engine]")].map(({ dataset }) => [dataset.engine, dataset.label]));
const shortName = (name) => labels[name];
const mean = (rows) => rows.reduce((sum, row) => sum + row[1], 0) / rows.length;

// Keeps the rows of the last second; the first number of a row is its time in ms.
function recent(rows, row) {
  rows.push(row);
  while (rows[0][0] < row[0] - 1000) rows.shift();
}

window.game = new Game();

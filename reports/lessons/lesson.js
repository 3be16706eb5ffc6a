"use strict";
// A lesson's page: the sliders ask for an answer, from the server or from the page itself, and it is drawn.

const looks = JSON.parse(document.getElementById("looks").textContent);
const darkness = matchMedia("(prefers-color-scheme: dark)");
const darkPage = () => darkness.matches;
const nameOf = (name) => document.querySelector(`.names [data-name="${CSS.escape(name)}"]`).textContent.trim();

const PATIENCE = 700;  // ms, after which the page says what it waits for
const SLOW = "Playing this setting. The first one of a lesson can take a minute, while its engines are compiled; what is grey is of the setting before.";

class Lesson {
  constructor() {
    this.sliders = [...document.querySelectorAll(".sliders :is(input, select)")];
    this.place = JSON.parse(document.getElementById("place").textContent);
    const packed = document.getElementById("grid").textContent;
    this.grid = packed ? inflate(packed).then((bytes) => JSON.parse(new TextDecoder().decode(bytes))) : null;
    for (const slider of this.sliders) slider.addEventListener("input", () => this.moved(slider));
    document.querySelector(".sliders").addEventListener("submit", (event) => event.preventDefault());
    for (const item of document.querySelectorAll(".names li")) {
      const button = item.querySelector("button");
      for (const event of ["pointerenter", "focus"]) button.addEventListener(event, () => raise(item.dataset.name));
      for (const event of ["pointerleave", "blur"]) button.addEventListener(event, () => raise(null));
    }
    darkness.addEventListener("change", () => this.show(this.shown));
    this.ready = this.show(JSON.parse(document.getElementById("first").textContent));
  }

  get at() { return this.sliders.map((slider) => slider.value).join(","); }

  moved(slider) {
    if (slider.dataset.shown) this.say(slider, JSON.parse(slider.dataset.shown)[slider.value]);  // a list says its own
    this.asking ??= this.ask().finally(() => { this.asking = null; });  // one at a time; it goes on to where the slider is by then
    this.ready = this.asking;
  }

  say(slider, text) {
    slider.parentElement.querySelector("output").textContent = text;
    slider.setAttribute("aria-valuetext", text);
  }

  // Until the answer is that to where the sliders are: those passed meanwhile are never asked for.
  async ask() {
    document.querySelector("main").classList.add("busy");
    const [fault, waiting] = [".fault", ".waiting"].map((name) => document.querySelector(name));
    const slow = this.grid ? 0 : setTimeout(() => { waiting.textContent = SLOW; }, PATIENCE);
    try {
      let at, shown;
      do {
        at = this.at;
        shown = this.grid ? (await this.grid)[at] : await (await fetch(`${this.place}?at=${at}`)).json();
        if (at !== this.at) continue;
        fault.textContent = shown.fault ?? "";
        if (!shown.fault) await this.show(shown);
      } while (at !== this.at);
    } catch {
      fault.textContent = "The server does not answer: start it again with crosscheck lesson.";
    }
    clearTimeout(slow);
    waiting.textContent = "";
    document.querySelector("main").classList.remove("busy");
  }

  async show(shown) {
    this.shown = shown;
    for (const slider of this.sliders) if (slider.dataset.shown) this.say(slider, shown.said[slider.name] ?? JSON.parse(slider.dataset.shown)[slider.value]);
    document.querySelector(".curves").replaceChildren(...shown.charts.map(drawChart));
    for (const item of document.querySelectorAll(".names li")) item.hidden = !shown.drawn.includes(item.dataset.name);
    document.querySelector(".claims").replaceChildren(...shown.claims.map(([text, holds]) => holds ? row("li", ["span", text]) : row("li", ["b", "Not in this run:"], ["span", text])));
    document.querySelector(".worked").replaceChildren(...shown.steps.map(([what, text]) => row("li", ["b", what], ["span", text])));
    document.querySelector(".facts-table tbody").replaceChildren(...shown.facts.map(([what, text]) => row("tr", ["th", what], ["td", text])));
    if (shown.film) await this.replay(shown.film);
  }

  async replay(film) {
    const pack = readPack(await inflate(film.pack));
    const element = document.querySelector(".player");
    element.querySelector(".picture").style.setProperty("--ratio", film.ratio);
    const all = this.shown.drawn.every((name) => !name.includes(":") || film.names.includes(name));
    element.querySelector(".replayed").textContent = all ? "" : `The replay shows ${film.names.map(nameOf).join(" and ")} only. `;
    if (!this.player) {
      this.player = players.lesson = new Player(element, pack, looks);
      return;
    }
    const { time, playing } = this.player;
    this.player.showPack(pack);
    this.player.seek(time);
    if (playing) this.player.start();
  }
}

function row(kind, ...cells) {
  const element = document.createElement(kind);
  for (const [name, text] of cells) {
    const cell = document.createElement(name);
    cell.textContent = text;
    if (name === "th") cell.scope = "row";
    element.append(cell);
  }
  return element;
}

window.lesson = new Lesson();

"use strict";
// The page around the players: charts drawn when they come into view, the legend, the index, light and dark.

const looks = JSON.parse(document.getElementById("looks").textContent);
const darkness = matchMedia("(prefers-color-scheme: dark)");
const darkPage = () => darkness.matches;
// Plotly, deflated to a third of its size. The content policy holds its hash, so that it may run, and nothing else.
const library = unpack("library").then((bytes) => {
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(bytes);
  document.head.append(script);
});
const drawn = new Map();  // the element of a chart -> its figure as JSON text, on light

function themed(text, dark = darkPage()) {
  if (!dark) return JSON.parse(text);
  return JSON.parse(Object.values(looks).reduce((all, look) => all.replaceAll(look.light, look.dark), text));
}

// ink: "" for the colours of the page, "paper-" for those of paper.
function layoutOf(figure, ink = "") {
  const css = getComputedStyle(document.documentElement);
  const [text, line, soft] = ["text", "line", "soft"].map((name) => css.getPropertyValue(`--${ink}${name}`).trim());
  const axis = { gridcolor: line, linecolor: line, zeroline: false, ticks: "outside", tickcolor: line, automargin: true };
  const layout = figure.layout;
  for (const name of ["xaxis", "yaxis"]) {
    layout[name] = { ...layout[name], ...axis, title: { text: layout[name].title, font: { size: 12 }, standoff: 8 } };
  }
  return {
    ...layout, template: null, showlegend: false, height: layout.height ?? 290, margin: { l: 58, r: 12, t: 26, b: 44 },
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: 12, color: text },
    dragmode: matchMedia("(pointer: coarse)").matches ? false : "zoom",  // a finger scrolls the page
    modebar: { bgcolor: "rgba(0,0,0,0)", color: soft, activecolor: text },
    hoverlabel: { font: { family: "system-ui, sans-serif" }, namelength: -1 },
  };
}

function withoutHidden(figure, plot) {
  const off = hiddenIn(plot.closest(".scenario"));
  for (const trace of figure.data) trace.visible = !off.has(trace.name);
  return figure;
}

async function drawChart(plot, text) {
  await library;
  const figure = withoutHidden(themed(text), plot);
  drawn.set(plot, text);
  return Plotly.react(plot, figure.data, layoutOf(figure), {
    responsive: true, displaylogo: false,
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]],  // none that goes online
  });
}

function hiddenIn(scenario) {
  const off = [...scenario.querySelectorAll(".legend input:not(:checked)")];
  return new Set(off.map((box) => box.value));
}

async function chartsOf(scenario) {
  return JSON.parse(new TextDecoder().decode(await unpack(`charts:${scenario.dataset.name}`)));
}

async function openCharts(scenario) {
  const charts = await chartsOf(scenario);
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((each) => each.isIntersecting)) {
      watch.unobserve(entry.target);
      drawChart(entry.target, JSON.stringify(charts[entry.target.dataset.chart]));
    }
  }, { rootMargin: "300px" });
  scenario.querySelectorAll(".plot").forEach((plot) => watch.observe(plot));
  const pick = scenario.querySelector(".pick select");
  if (pick) pick.onchange = () => showPicked(pick, charts);
}

// Draws another figure in the place of the one above or below the picker, on paper as well.
function showPicked(pick, charts) {
  const plot = pick.closest("figure").querySelector(".plot");
  plot.dataset.chart = pick.value;
  const text = JSON.stringify(charts[pick.value]);
  if (plot.dataset.paper) printed.set(plot, text);
  drawChart(plot, text);
}

async function openPlayer(scenario) {
  const element = scenario.querySelector(".player");
  if (!element) return;
  const player = new Player(element, readPack(await unpack(scenario.dataset.replay || `replay:${scenario.dataset.name}`)), looks);
  hiddenIn(scenario).forEach((name) => player.hidden.add(name));
  players[scenario.dataset.name] = player;
}

function openScenario(scenario) {
  openPlayer(scenario);
  openCharts(scenario);
  const boxes = [...scenario.querySelectorAll(".legend input")];
  boxes.forEach((box) => { box.onchange = () => showLayers(scenario, [box]); });
  scenario.querySelectorAll(".picks button").forEach((button) => {
    button.onclick = () => {
      boxes.forEach((box) => { box.checked = Boolean(button.dataset.all); });
      showLayers(scenario, boxes);
    };
  });
}

// Shows or hides in the replay and in the charts what these boxes of the legend stand for.
function showLayers(scenario, boxes) {
  boxes.forEach((box) => players[scenario.dataset.name]?.show(box.value, box.checked));
  const shown = new Map(boxes.map((box) => [box.value, box.checked]));
  scenario.querySelectorAll(".plot").forEach((plot) => {
    const traces = (plot.data || []).map((trace, k) => [trace.name, k]).filter(([name]) => shown.has(name));
    if (!traces.length) return;
    Plotly.restyle(plot, { visible: traces.map(([name]) => shown.get(name)) }, traces.map(([, k]) => k));
  });
}

function watchScenarios() {
  const near = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((each) => each.isIntersecting)) {
      near.unobserve(entry.target);
      openScenario(entry.target);
    }
  }, { rootMargin: "600px" });
  const links = new Map([...document.querySelectorAll("#index a")].map((a) => [a.hash.slice(1), a]));
  // What stands on a line a little below the top of the window: where a link leads to, however short it is.
  const places = [...links.keys()].map((id) => document.getElementById(id)).filter(Boolean), onLine = new Set();
  const here = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (isIntersecting) onLine.add(target);
      else {
        onLine.delete(target);
        players[target.dataset.name]?.stop();
      }
    }
    const link = links.get(places.findLast((place) => onLine.has(place))?.id);
    if (!link) return;
    links.forEach((other) => other.removeAttribute("aria-current"));
    link.setAttribute("aria-current", "true");
    keepInSight(link);
  }, { rootMargin: "-6% 0px -93% 0px" });
  document.querySelectorAll(".scenario").forEach((scenario) => near.observe(scenario));
  places.forEach((place) => here.observe(place));
}

// The index scrolls by itself, and never moves the page while it does.
function keepInSight(link) {
  const list = document.querySelector("#index .list");
  if (list.clientHeight >= list.scrollHeight) return;
  const [inner, outer] = [link.getBoundingClientRect(), list.getBoundingClientRect()];
  if (inner.top < outer.top || inner.bottom > outer.bottom) list.scrollTop += inner.top - outer.top - outer.height / 2;
}

function startIndex() {
  const index = document.getElementById("index");
  const wide = matchMedia("(min-width: 1000px)");
  const arrange = () => { index.open = wide.matches; };
  wide.addEventListener("change", arrange);
  arrange();
  index.addEventListener("click", (event) => { if (event.target.closest("a") && !wide.matches) index.open = false; });
  const filter = index.querySelector("input");
  filter.addEventListener("input", () => {
    const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    index.querySelectorAll("li[data-find]").forEach((item) => {
      item.hidden = !words.every((word) => item.dataset.find.includes(word));
    });
    index.querySelectorAll(".family").forEach((family) => {
      family.hidden = !family.querySelector("li:not([hidden])");
    });
  });
}

darkness.addEventListener("change", () => {
  drawn.forEach((text, plot) => drawChart(plot, text));
  Object.values(players).forEach((player) => player.draw());
});
startIndex();
watchScenarios();

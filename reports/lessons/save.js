"use strict";
// A chart in a file: its picture as SVG with title and legend, its numbers as CSV.

const DRAWN = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "opacity", "font-size", "font-family", "paint-order"];
const ROW = 16;  // height of a line of the legend

function savesOf(chart, picture) {
  const line = document.createElement("p");
  line.className = "saves";
  line.append("Save as ");
  for (const [kind, text] of [["SVG", () => pictureOf(chart, picture)], ["CSV", () => numbersOf(chart)]]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = kind;
    button.onclick = () => saveText(`${document.title} - ${chart.title}.${kind.toLowerCase()}`, text());
    line.append(button, " ");
  }
  return line;
}

function saveText(name, text) {
  const link = document.createElement("a");
  link.download = name;
  link.href = `data:text/plain;charset=utf-8,${encodeURIComponent(text)}`;
  link.click();
}

// A row for each point of each curve.
function numbersOf(chart) {
  const quoted = (value) => `"${String(value ?? "").replaceAll("\"", "\"\"")}"`;
  const rows = [["curve", chart.x, chart.y].map(quoted)];
  for (const curve of chart.curves) curve.x.forEach((x, k) => rows.push([quoted(nameOf(curve.name)), x, curve.y[k] ?? ""]));
  return rows.map((row) => row.join(",")).join("\n") + "\n";
}

// The picture as it is seen, with the styles that the page gives it, its title above and its legend below.
function pictureOf(chart, picture) {
  const copy = picture.cloneNode(true);
  const seen = [picture, ...picture.querySelectorAll("*")];
  [copy, ...copy.querySelectorAll("*")].forEach((element, k) => dress(element, getComputedStyle(seen[k])));
  copy.querySelectorAll("title, .near").forEach((element) => element.remove());
  const [left, , width, height] = picture.getAttribute("viewBox").split(" ").map(Number);
  const swatches = [...document.querySelectorAll(".names li:not([hidden])")];
  const top = 2 * ROW, whole = top + height + (swatches.length + 1) * ROW;
  const style = getComputedStyle(document.body);
  const text = (x, y, words, size = 12) => svg("text", { x, y, "font-size": size, "font-family": style.fontFamily, fill: style.color }, words);
  copy.prepend(svg("rect", { x: left, y: -top, width, height: whole, fill: style.backgroundColor }), text(left + ROW, -top / 3, chart.title, 14));
  swatches.forEach((item, k) => {
    const y = height + (k + 1) * ROW;
    const swatch = item.querySelector("svg").cloneNode(true);
    const shown = [item.querySelector("svg"), ...item.querySelectorAll("svg *")];
    [swatch, ...swatch.querySelectorAll("*")].forEach((element, j) => dress(element, getComputedStyle(shown[j])));
    const group = svg("g", { transform: `translate(${left + 3 * ROW},${y - 4})` });
    group.append(...swatch.children);
    copy.append(group, text(left + 5 * ROW, y, nameOf(item.dataset.name)));
  });
  const size = { xmlns: "http://www.w3.org/2000/svg", viewBox: `${left} ${-top} ${width} ${whole}`, width: 1.5 * width, height: 1.5 * whole };
  for (const [key, value] of Object.entries(size)) copy.setAttribute(key, value);
  return new XMLSerializer().serializeToString(copy);
}

function dress(element, style) {
  for (const key of DRAWN) element.setAttribute(key, style.getPropertyValue(key));
  element.removeAttribute("class");
}

"use strict";
// Charts on paper and in files: printed with the page, saved as SVG, their numbers as CSV.

const printed = new Map();  // the element of a chart that is on paper -> its figure as JSON text

// What is to be printed is unpacked when the page opens: `beforeprint` cannot wait for it.
async function preparePaper() {
  for (const scenario of document.querySelectorAll("[data-on-paper]")) {
    const charts = await chartsOf(scenario);
    scenario.querySelectorAll(".plot[data-paper]").forEach((plot) => {
      printed.set(plot, JSON.stringify(charts[plot.dataset.chart]));
    });
  }
}

// Draws every chart that is on paper, in the colours and at the width of paper, whether or not it has been in view.
function drawPaper() {
  if (!window.Plotly) return;
  clearPaper();
  for (const [plot, text] of printed) {
    const sheet = document.createElement("div");
    sheet.className = "sheet";
    plot.after(sheet);
    const figure = onPaper(text, plot);
    const width = Number(plot.dataset.paper);
    const size = { width, height: width > 400 ? 330 : 210, margin: { l: 52, r: 10, t: 8, b: 40 } };
    Plotly.newPlot(sheet, figure.data, { ...figure.layout, ...size }, { staticPlot: true });
  }
}

function clearPaper() {
  document.querySelectorAll(".sheet").forEach((sheet) => { Plotly.purge(sheet); sheet.remove(); });
}

function onPaper(text, plot) {
  const figure = withoutHidden(themed(text, false), plot);
  return { data: figure.data, layout: layoutOf(figure, "paper-") };
}

// A row for each point of what is shown: the number itself, where the chart draws it below a break of its axis; the column of
// a chart that has columns; and what a point says of itself.
function numbersOf(plot) {
  const { data, layout } = withoutHidden(JSON.parse(drawn.get(plot)), plot);
  const quoted = (value) => `"${String(value ?? "").replaceAll("\"", "\"\"")}"`;
  const titles = [layout.xaxis, layout.yaxis].map((axis) => axis.title ?? "");
  const columns = layout.meta?.columns;
  const traces = data.filter((each) => each.visible && each.hoverinfo !== "skip");
  const says = traces.some((each) => each.text);
  const rows = [["engine", columns ? layout.meta.of : titles[0], titles[1], ...(says ? ["point"] : [])].map(quoted)];
  for (const trace of traces) {
    trace.x.forEach((x, k) => {
      const value = (trace.customdata ?? trace.y)[k] ?? "", failed = trace.customdata && value === "";
      const said = says ? [quoted(trace.text?.[k].replaceAll("<br>", "; "))] : [];
      rows.push([quoted(trace.name), columns ? quoted(columns[Math.round(x)]) : failed ? "" : x ?? "", value, ...said]);
    });
  }
  return rows.map((row) => row.join(",")).join("\n") + "\n";
}

async function imageOf(plot) {
  const figure = onPaper(drawn.get(plot), plot);
  const margin = { l: 70, r: 20, t: 50, b: 60 };
  const layout = { ...figure.layout, showlegend: true, margin, title: { text: plot.dataset.title, font: { size: 15 } } };
  return Plotly.toImage({ data: figure.data, layout }, { format: "svg", width: 900, height: Math.max(layout.height, 420) });
}

async function save(button) {
  const plot = button.closest("figure").querySelector(".plot");
  if (!drawn.has(plot)) return;
  const kind = button.dataset.save;
  const link = document.createElement("a");
  link.download = `${plot.closest(".scenario").dataset.name}-${plot.dataset.chart}.${kind}`;
  link.href = kind === "svg" ? await imageOf(plot) : `data:text/csv;charset=utf-8,${encodeURIComponent(numbersOf(plot))}`;
  link.click();
}

document.querySelectorAll(".saves button").forEach((button) => { button.onclick = () => save(button); });
addEventListener("beforeprint", drawPaper);
addEventListener("afterprint", clearPaper);
preparePaper();

"use strict";
// A page of sections: rows that open, addresses that open them, tables that sort, code to copy, paper.

const packed = Object.fromEntries([...document.querySelectorAll("script[data-opens]")].map((script) => [script.dataset.opens, script]));

async function openRow(row, open = row.nextElementSibling?.className !== "opened") {
  const button = row.querySelector("button.open");
  const shown = row.nextElementSibling?.className === "opened" ? row.nextElementSibling : null;
  button.setAttribute("aria-expanded", open);
  if (!open || shown) {
    if (!open) shown?.remove();
    return;
  }
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

function copy(button) {
  navigator.clipboard?.writeText(button.closest(".code").querySelector("pre").textContent);
  button.textContent = "copied";
}

// A heading sorts the rows by its column; a text leaves those that contain it.
function sortable(table) {
  const order = new Intl.Collator(undefined, { numeric: true }).compare;
  const rows = [...table.tBodies[0].rows], headings = [...table.tHead.rows].at(-1).cells;
  [...headings].forEach((heading, column) => {
    heading.querySelector("button").onclick = () => {
      const down = heading.getAttribute("aria-sort") === "ascending";
      for (const other of headings) other.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", down ? "descending" : "ascending");
      table.querySelectorAll("tr.opened").forEach((row) => row.remove());
      const text = (row) => row.cells[column].textContent.trim();
      rows.sort((a, b) => (down ? -1 : 1) * order(text(a), text(b)));
      table.tBodies[0].append(...rows);
    };
  });
  const filter = table.closest(".scroll").previousElementSibling;
  filter.querySelector("input").oninput = ({ target }) => {
    const text = target.value.toLowerCase();
    const holds = (row) => [row.textContent, ...[...row.querySelectorAll("[title]")].map((cell) => cell.title)].join("\n").toLowerCase().includes(text);
    table.querySelectorAll("tr.opened").forEach((row) => row.remove());
    for (const row of rows) row.hidden = !holds(row);
    filter.querySelector("output").value = text ? `${rows.filter((row) => !row.hidden).length} of ${rows.length}` : "";
  };
}

function begin(root) {
  root.querySelectorAll("button.open").forEach((button) => { button.onclick = () => openRow(button.closest("tr")); });
  root.querySelectorAll("button.copy").forEach((button) => { button.onclick = () => copy(button); });
  root.querySelectorAll("table.sortable").forEach(sortable);
  root.querySelectorAll("details").forEach((fold) => fold.addEventListener("toggle", () => startReplays(fold)));
}

function drawAll() { Object.values(players).forEach((player) => player.draw()); }

darkness.addEventListener("change", drawAll);
// On paper: the paths, and the disks at their ends; pictures side by side stay at their first difference.
function print(begins) {
  onPaper = begins;
  for (const player of Object.values(players)) if (!player.pack.panels) player.seek(begins ? player.until : player.time);
  drawAll();
}

addEventListener("beforeprint", () => print(true));
addEventListener("afterprint", () => print(false));
addEventListener("hashchange", follow);
begin(document);
startReplays(document).then(follow);

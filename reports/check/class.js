"use strict";
// The page of a class: its rows sorted by a column, and those that contain a text.

const table = document.querySelector(".students");
const rows = [...table.tBodies[0].rows];
const headings = [...table.tHead.rows[0].cells];
const shown = document.getElementById("shown");
const order = new Intl.Collator(undefined, {numeric: true}).compare;

headings.forEach((heading, column) => {
  heading.querySelector("button").onclick = () => {
    const down = heading.getAttribute("aria-sort") === "ascending";
    headings.forEach((one) => one.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    const text = (row) => row.cells[column].textContent.trim();
    rows.sort((a, b) => (down ? -1 : 1) * order(text(a), text(b)));
    table.tBodies[0].append(...rows);
  };
});

document.getElementById("filter").oninput = (event) => {
  const wanted = event.target.value.toLowerCase();
  // not in the titles of tasks, which every row has
  const texts = "th, td:not(.begin), summary, li, p";
  const holds = (row) => [...row.querySelectorAll(texts)]
    .some((one) => one.textContent.toLowerCase().includes(wanted));
  rows.forEach((row) => { row.hidden = !holds(row); });
  shown.value = wanted ? `${rows.filter((row) => !row.hidden).length} of ${rows.length}` : "";
};

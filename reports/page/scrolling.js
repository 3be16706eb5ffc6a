"use strict";
// Boxes that scroll can be reached by keyboard, and have a name; those in which all is in sight are passed over.

function reachable(box) {
  const scrolls = box.scrollWidth > box.clientWidth + 1 || box.scrollHeight > box.clientHeight + 1;
  if (!scrolls) {
    ["tabindex", "role", "aria-label"].forEach((name) => box.removeAttribute(name));
    return;
  }
  const heading = box.querySelector("caption") ?? box.closest("section, nav, footer")?.querySelector("h1, h2, h3");
  box.tabIndex = 0;
  box.setAttribute("role", "region");
  box.setAttribute("aria-label", `${heading?.textContent.trim() || "Contents"}, scrolls`);
}

const BOXES = ".scroll, #index .list";
const sizes = new ResizeObserver((entries) => entries.forEach((entry) => reachable(entry.target.closest(BOXES))));
document.querySelectorAll(BOXES).forEach((box) => [box, ...box.children].forEach((each) => sizes.observe(each)));

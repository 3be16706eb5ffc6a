"use strict";
// The page of a check: a replay of each of its scenes, its legend, light and dark.

const looks = JSON.parse(document.getElementById("looks").textContent);
const darkness = matchMedia("(prefers-color-scheme: dark)");
let onPaper = false;
const darkPage = () => darkness.matches && !onPaper;

async function openReplay(section) {
  const number = section.dataset.scene;
  const pack = readPack(await unpack(`replay:${number}`));
  const player = new Player(section.querySelector(".player"), pack, looks);
  player.seek(0);
  players[number] = player;
  section.querySelectorAll(".legend input").forEach((box) => {
    box.onchange = () => player.show(box.value, box.checked);
  });
  darkness.addEventListener("change", () => player.draw());
}

// On paper: the paths, and the spheres at their ends.
function drawPaper(paper) {
  onPaper = paper;
  Object.values(players).forEach((player) => player.seek(paper ? player.until : player.time));
}

addEventListener("beforeprint", () => drawPaper(true));
addEventListener("afterprint", () => drawPaper(false));
document.querySelectorAll("[data-scene]").forEach(openReplay);

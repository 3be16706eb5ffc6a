"use strict";
// The page of a check: one replay, its legend, light and dark.

const looks = JSON.parse(document.getElementById("looks").textContent);
const darkness = matchMedia("(prefers-color-scheme: dark)");
const darkPage = () => darkness.matches;

async function openReplay(element) {
  const player = new Player(element, readPack(await unpack("replay")), looks);
  player.seek(0);
  players.smallest = player;
  document.querySelectorAll(".legend input").forEach((box) => {
    box.onchange = () => player.show(box.value, box.checked);
  });
  darkness.addEventListener("change", () => player.draw());
}

const element = document.querySelector(".player");
if (element) openReplay(element);

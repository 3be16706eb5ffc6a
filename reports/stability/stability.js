"use strict";
// The failures: a button of a limit shows that player's first failing run in the section's replay.

async function showFailure(button) {
  const scenario = button.closest(".scenario");
  const player = players[scenario.dataset.name];
  if (!player) return;
  const replay = scenario.querySelector(".picture");
  replay.style.setProperty("--ratio", button.dataset.ratio);
  scenario.querySelectorAll("button.watch").forEach((other) => other.setAttribute("aria-pressed", other === button));
  scenario.querySelector(".says").textContent = button.dataset.says;
  player.showPack(readPack(await unpack(button.dataset.replay)));
  const stage = scenario.querySelector(".stage").getBoundingClientRect();
  if (stage.top < 0 || stage.bottom > window.innerHeight) scenario.querySelector(".stage").scrollIntoView({ block: "nearest" });
}

document.querySelectorAll("button.watch").forEach((button) => { button.onclick = () => showFailure(button); });

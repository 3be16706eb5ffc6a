"use strict";
// The table of conventions takes a while to measure, so the page asks for it when all else is there.

(async () => {
  const place = document.getElementById("measured");
  try {
    const answer = await fetch("/lesson/conventions");
    if (!answer.ok) throw new Error(answer.statusText);
    place.innerHTML = await answer.text();
  } catch {
    place.textContent = "The server did not answer: start it again with crosscheck lesson.";
  }
})();

// Buttons that seek the replay, and links to lines of folded files.
"use strict";
const view = () => document.querySelector(".mc-player");

document.addEventListener("click", (event) => {
  const link = event.target.closest('a[href^="#"]');
  const folded = link && document.getElementById(decodeURIComponent(link.hash.slice(1)))?.closest("details");
  if (folded) folded.open = true;
  const from = event.target.closest("[data-seek]");
  const player = view()?.player;
  if (!from || !player) return;
  player.play(false);
  player.seek(Number(from.dataset.seek));
  view().scrollIntoView({ behavior: "smooth", block: "nearest" });
});

// Unfold everything for printing.
window.addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details")) details.open = true;
});

// Keys, their overlay, and the start of the player.

// Adds a key: what it is called in the overlay, what it does there, and what it calls; `matches`: the values of
// `event.key`. Other files may add theirs at any time.
function shortcut(name, what, matches, does) {
  (shortcut.list ||= []).push({ name, what, matches, does });
}

// The step that begins after the time (1), or before it (-1).
function stepBeside(way) {
  const starts = run.steps.map((step) => step.start);
  const found = way > 0 ? starts.find((start) => start > time + 1e-6) : starts.filter((start) => start < time - 1e-6).pop();
  if (found !== undefined) seek(found);
}

function sampleBeside(way) {
  const at = (time - run.start) / (run.step || 1), next = way > 0 ? Math.floor(at + 1e-4) + 1 : Math.ceil(at - 1e-4) - 1;
  seek(run.start + next * run.step);
}

function buildKeys() {
  const help = part("help"), track = part("track");
  shortcut("space", "play or pause", [" "], () => play(!playing));
  shortcut("← →", "0.1 s back or on; with shift 1 s", ["ArrowLeft", "ArrowRight"],
    (event) => seek(time + (event.key === "ArrowRight" ? 1 : -1) * (event.shiftKey ? 1 : 0.1)));
  shortcut(", .", `one sample (${+(1000 * run.step).toFixed(1)} ms) back or on`, [",", "."], (event) => sampleBeside(event.key === "." ? 1 : -1));
  shortcut("p n", "previous or next step", ["p", "n"], (event) => stepBeside(event.key === "n" ? 1 : -1));
  shortcut("home end", "start or end of the run", ["Home", "End"], (event) => seek(event.key === "Home" ? run.start : run.end));
  if (failures.length) shortcut("f", failures.length > 1 ? "next failure" : "failure", ["f"], showNextFailure);
  shortcut("?", "this list", ["?"], () => help.showModal());
  const fill = () => {
    const list = help.querySelector("dl");
    list.textContent = "";
    for (const { name, what } of shortcut.list) {
      const row = element(list, "div"), keys = element(row, "dt");
      for (const key of name.split(" ")) element(keys, "kbd", "", key);
      element(row, "dd", "", what);
    }
  };
  help.addEventListener("beforetoggle", fill);
  help.addEventListener("click", (event) => { if (event.target === help) help.close(); });
  part("help-close").addEventListener("click", () => help.close());
  part("help-open").addEventListener("click", () => help.showModal());
  (root.dataset.page ? document : root).addEventListener("keydown", (event) => {
    const kind = event.target.tagName;
    if (help.open || kind === "SELECT" || event.ctrlKey || event.metaKey || event.altKey) return;
    if (kind === "INPUT" && event.target.type !== "checkbox") return;
    if (event.key === " " && ["BUTTON", "INPUT", "SUMMARY"].includes(kind)) return;
    const slides = event.target === track ? { ArrowUp: 0.1, ArrowDown: -0.1 }[event.key] : undefined;
    const found = shortcut.list.find(({ matches }) => matches.includes(event.key));
    if (slides) seek(time + slides);
    else if (found) found.does(event);
    else return;
    event.preventDefault();
  });
}

function complain(text) {
  element(root.querySelector(".view"), "div", "trouble", text);
}

async function begin() {
  await unpack();
  stamps = array(run.times);
  measured = array(run.position);
  wanted = run.reference ? array(run.reference) : null;
  bodies = array(run.body);
  ghosts = run.ghosts.map((ghost, k) => ({ ...ghost, position: array(ghost.position), body: array(ghost.body), ...ghostLook(ghost, k) }));
  if (run.pushes) [pushFirst, pushes, pushPair] = ["first", "rows", "pair"].map((name) => array(run.pushes[name]));
  if (run.pushes) pushTimes = array(run.pushes.times);
  for (const table of run.curves) {
    table.times = array(table.times);
    table.values = array(table.values);
    if (table.relative) table.relative = array(table.relative);
  }
  look();
  try {
    furnish(part("canvas"));
    steer(part("canvas"));
  } catch (error) {
    gl = null;
    complain(error.message);
  }
  build();
  open();
  // For scripts and tests.
  root.player = { run, camera, pick, pointAt, seek, play, poses: (t) => poses(measured, t),
    ghosts: (t) => ghosts.map((ghost) => poses(ghost.position, t, ghost.body)), get time() { return time; }, get playing() { return playing; } };
}

begin().catch((error) => complain("Cannot show the run: " + error.message));

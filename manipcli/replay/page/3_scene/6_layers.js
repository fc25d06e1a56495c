// The panel of layers: what is drawn, and how large.

const shows = { visual: true, collision: false, wire: false, shadows: true, grid: true, forces: true, numbers: false,
  trail: true, path: true, ghost: false, inertia: false, mass: false, frames: false };
const sizes = { trail: 3, axes: 1, force: 1 };
const hiddenFrames = new Set();
// [group, key of `shows`, text, title, whether there is anything to show]; other scripts add theirs before `build`.
const switches = [
  ["shapes", "visual", "visual shapes", "what the robot and the bodies look like", () => true],
  ["shapes", "collision", "collision shapes", "what planner and physics use; meshes as convex hulls", () => run.collision.length],
  ["shapes", "wire", "wireframe", "edges of the triangles", () => true],
  ["shapes", "shadows", "shadows", "", () => true],
  ["shapes", "grid", "grid (10 cm)", "on the ground", () => true],
  ["physics", "forces", "contact forces", "at each contact point: the normal force (red) and friction (orange) on the body", () => run.pushes],
  ["physics", "numbers", "numbers", "normal force and friction of each pair together", () => run.pushes],
  ["physics", "inertia", "inertia", "boxes of equal mass and inertia", () => run.inertias.length],
  ["physics", "mass", "centres of mass", "with masses; the large one is that of the robot", () => run.inertias.length],
  ["tool", "trail", "trail", "where the tool was in the last seconds", () => run.path],
  ["tool", "path", "whole path", "of the tool, over the whole run", () => run.path],
  ["ghosts", "ghost", "reference", "where the controllers want the robot", () => run.reference],
];

function buildLayers() {
  const panel = element(part("layers"), "details", "layer-panel");
  element(panel, "summary", "", "Layers");
  const body = element(panel, "div", "panel"), groups = new Map();
  // Keys are for what has the focus, not for the time.
  body.addEventListener("keydown", (event) => { if (event.target.matches("input:not([type=checkbox])")) event.stopPropagation(); });
  const group = (name) => {
    if (!groups.has(name)) {
      const made = element(body, "fieldset");
      element(made, "legend", "", name);
      groups.set(name, made);
    }
    return groups.get(name);
  };
  // A switch for each other run and for the plan, in its colour.
  for (const { key, name, title, colour } of ghosts) {
    shows[key] = true;
    switches.push(["ghosts", key, name, title, () => true, `rgb(${colour.slice(0, 3).map((c) => Math.round(255 * c)).join(" ")})`]);
  }
  for (const [name, key, text, title, there, colour] of switches) {
    if (!there()) continue;
    const box = choice(group(name), text, shows[key], (on) => { shows[key] = on; refresh(); });
    box.dataset.part = "show-" + key;
    box.parentNode.title = title;
    if (colour) [box.parentNode.style.color, box.parentNode.style.fontWeight] = [colour, 600];
    if (key === "trail") slider(group(name), "last", sizes.trail, 0.5, Math.max(run.end - run.start, 1), 0.5, (v) => `${v} s`, (v) => { sizes.trail = v; });
    if (key === "forces") slider(group(name), "length", 0, -2, 2, 0.5, (v) => `${+(2 ** v).toFixed(2)} ×`, (v) => { sizes.force = 2 ** v; });
  }
  if (!run.drawables.length) shows.frames = true; // a log with frames only
  if (run.axes.length) buildFrames(group("frames"));
  const bar = element(part("layers"), "div", "force-scale");
  bar.dataset.part = "scale";
  bar.title = "length of the arrow of this force";
  element(bar, "i");
  element(bar, "span");
}

function choice(parent, text, on, change) {
  const line = element(parent, "label"), box = element(line, "input");
  box.type = "checkbox";
  box.checked = on;
  line.append(text);
  box.addEventListener("change", () => change(box.checked));
  return box;
}

function slider(parent, text, at, low, high, step, show, change) {
  const line = element(parent, "label", "slider", text), box = element(line, "input"), told = element(line, "output", "", show(at));
  Object.assign(box, { type: "range", min: low, max: high, step, value: at });
  box.addEventListener("input", () => { change(Number(box.value)); told.textContent = show(Number(box.value)); refresh(); });
}

// A tree of the frames, with a search.
function buildFrames(parent) {
  const box = choice(parent, "axes and names", shows.frames, (on) => { shows.frames = on; refresh(); });
  box.dataset.part = "show-frames";
  slider(parent, "size", 0, -2, 2, 0.5, (v) => `${+(2 ** v).toFixed(2)} ×`, (v) => { sizes.axes = 2 ** v; });
  const find = element(parent, "input", "find"), tree = element(parent, "div", "tree"), rows = [];
  Object.assign(find, { type: "search", placeholder: "search frames" });
  find.setAttribute("aria-label", "search frames");
  const all = choice(tree, "all", true, (on) => { for (const row of rows) if (!row.line.hidden) row.set(on); refresh(); });
  all.parentNode.classList.add("all");
  const walk = (frame, depth) => {
    for (const axes of run.axes.filter((axes) => axes.frame === frame)) {
      const set = (on) => {
        row.checked = on;
        if (on) hiddenFrames.delete(axes); else hiddenFrames.add(axes);
      };
      const row = choice(tree, axes.name, true, (on) => { set(on); refresh(); });
      row.parentNode.style.paddingLeft = `${10 * (depth + (axes.p ? 1 : 0))}px`;
      rows.push({ line: row.parentNode, name: axes.name.toLowerCase(), set });
    }
    run.frames.forEach((each, k) => { if (each.parent === frame) walk(k, depth + 1); });
  };
  for (const k of run.order) if (run.frames[k].parent === undefined) walk(k, 0);
  find.addEventListener("input", () => { for (const row of rows) row.line.hidden = !row.name.includes(find.value.toLowerCase()); });
}

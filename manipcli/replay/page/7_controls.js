// Controls, and the start of the player.

function element(parent, kind, name, text = "") {
  const made = parent.appendChild(document.createElement(kind));
  if (name) made.className = name;
  made.textContent = text;
  return made;
}

function scrub(box, at) {
  const move = (event) => { if (event.buttons || event.type === "pointerdown") seek(at(event)); };
  box.addEventListener("pointerdown", (event) => { box.setPointerCapture(event.pointerId); move(event); });
  box.addEventListener("pointermove", move);
}

// The label of a step without the blocks around it, and these blocks: `pick_1` and `stack[0]`.
function placed(step) {
  const name = step.id.match(/(?:(?<=\/)else\/)?[^/]*$/)[0], around = step.id.slice(0, step.id.length - name.length);
  return { short: step.label.startsWith(around) ? step.label.slice(around.length) : step.label, around: around.split("/").slice(0, -1) };
}

// An entry of the list of steps, indented under the names of the blocks around it; `list.around`: of the entry before.
function entry(list, kind, step, mark, title) {
  const { short, around } = placed(step), indent = (made, depth) => { if (depth) made.style.marginLeft = `${14 * depth}px`; };
  const shared = around.findIndex((name, k) => name !== (list.around || [])[k]);
  for (let k = shared < 0 ? around.length : shared; k < around.length; k++)
    indent(element(list, "div", "block", around[k]), k);
  list.around = around;
  const made = element(list, kind);
  indent(made, around.length);
  made.title = title;
  element(made, "span", "mark" + (mark === "✗" ? " bad" : ""), mark);
  element(made, "span", "label", short);
  return made;
}

function build() {
  const track = part("track"), length = run.end - run.start || 1, good = (step) => step.outcome === "done";
  track.setAttribute("aria-valuemin", run.start.toFixed(2));
  track.setAttribute("aria-valuemax", run.end.toFixed(2));
  const list = part("steps"), skip = (k) => {
    for (const step of run.skipped.filter((one) => one.after === k)) {
      const row = entry(list, "div", step, "–", `${step.label}: skipped${step.text ? "\n" + step.text : ""}`);
      row.className = "skipped";
      element(row, "span", "when", "skipped");
    }
  };
  skip(0);
  run.steps.forEach((step, k) => {
    const piece = track.insertBefore(document.createElement("div"), part("head-line"));
    piece.className = "step" + (good(step) ? "" : " bad");
    piece.dataset.step = k;
    piece.style.left = `${(100 * (step.start - run.start)) / length}%`;
    piece.style.width = `${(100 * (step.end - step.start)) / length}%`;
    piece.textContent = placed(step).short.replace(/^else\//, "");
    piece.title = `${step.label}: ${step.outcome}${step.text ? "\n" + step.text : ""}`;
    for (const phase of step.phases) {
      const line = element(piece, "div", "phase");
      line.style.left = `${(100 * (phase.start - step.start)) / (step.end - step.start || 1)}%`;
    }
    const button = entry(list, "button", step, good(step) ? "✓" : "✗", piece.title);
    button.type = "button";
    button.dataset.step = k;
    element(button, "span", "phase", step.phases.map((phase) => phase.name).join(" · "));
    element(button, "span", "when", `${step.start.toFixed(2)} s`);
    button.addEventListener("click", (event) => {
      seek(step.start);
      // After a click, keys control the time, not this button.
      if (event.detail) track.focus({ preventScroll: true });
    });
    skip(k + 1);
  });
  scrub(track, (event) => {
    const box = track.getBoundingClientRect();
    return run.start + ((event.clientX - box.left) / box.width) * length;
  });
  scrub(part("plot"), (event) => plot.at(event.clientX - part("plot").getBoundingClientRect().left));
  part("play").addEventListener("click", () => play(!playing));
  buildLayers();
  const tables = part("table"), columns = part("column");
  run.curves.forEach((table, k) => { element(tables, "option", "", table.name).value = k; });
  const fill = () => {
    plot.table = Number(tables.value);
    const table = run.curves[plot.table], chosen = columns.value;
    columns.textContent = "";
    element(columns, "option", "", "all").value = -1;
    if (table) table.columns.forEach((name, k) => { element(columns, "option", "", name).value = k; });
    if (chosen && columns.options.length > Number(chosen) + 1) columns.value = chosen;
    plot.column = Number(columns.value);
    refresh();
  };
  tables.addEventListener("change", fill);
  columns.addEventListener("change", () => { plot.column = Number(columns.value); refresh(); });
  part("span").addEventListener("change", () => { plot.span = Number(part("span").value); refresh(); });
  fill();
  (root.dataset.page ? document : root).addEventListener("keydown", (event) => {
    const kind = event.target.tagName, slider = event.target === track;
    const way = { ArrowRight: 1, ArrowLeft: -1, ...(slider ? { ArrowUp: 1, ArrowDown: -1 } : {}) }[event.key];
    if (kind === "SELECT" || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && kind !== "BUTTON" && kind !== "INPUT") play(!playing);
    else if (way) seek(time + way * (event.shiftKey ? 1 : 0.1));
    else if (event.key === "Home") seek(run.start);
    else if (event.key === "End") seek(run.end);
    else return;
    event.preventDefault();
  });
  new ResizeObserver(refresh).observe(root);
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
  ghosts = (run.ghosts || []).map(({ name, position, body }) => ({ name, position: array(position), body: array(body) }));
  if (run.pushes) [pushFirst, pushes, pushPair] = ["first", "rows", "pair"].map((name) => array(run.pushes[name]));
  for (const table of run.curves) table.values = array(table.values);
  look();
  try {
    furnish(part("canvas"));
    steer(part("canvas"));
  } catch (error) {
    gl = null;
    complain(error.message);
  }
  build();
  refresh();
  // For scripts and tests.
  root.player = { run, camera, pick, pointAt, seek, play, poses: (t) => poses(measured, t),
    ghosts: (t) => ghosts.map((ghost) => poses(ghost.position, t, ghost.body)), get time() { return time; }, get playing() { return playing; } };
}

begin().catch((error) => complain("Cannot show the run: " + error.message));

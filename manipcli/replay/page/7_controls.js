// Controls: the list of steps, the track, the switches.

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

// The steps in the order of the task; those that did not begin have no button.
function buildSteps() {
  const list = part("steps"), good = (step) => step.outcome === "done";
  const unbegun = (k) => {
    for (const step of run.unbegun.filter((one) => one.after === k)) {
      const row = entry(list, "div", step, step.word === "skipped" ? "–" : "○", `${step.label}: ${step.word}${step.text ? "\n" + step.text : ""}`);
      row.className = "unbegun";
      element(row, "span", "when", step.word);
    }
  };
  unbegun(0);
  run.steps.forEach((step, k) => {
    const title = `${step.label}: ${step.outcome}${step.text ? "\n" + step.text : ""}`;
    const button = entry(list, "button", step, good(step) ? "✓" : "✗", title);
    button.type = "button";
    button.dataset.step = k;
    if (run.causes.some((cause) => cause.step === step.id)) button.classList.add("failed");
    element(button, "span", "phase", step.phases.map((phase) => phase.name).join(" · "));
    element(button, "span", "when", `${step.start.toFixed(2)} s`);
    button.addEventListener("click", (event) => {
      seek(step.start);
      // After a click, keys control the time, not this button.
      if (event.detail) part("track").focus({ preventScroll: true });
    });
    unbegun(k + 1);
  });
}

function buildTrack() {
  const track = part("track"), length = run.end - run.start || 1, head = part("head-line");
  const share = (t) => `${(100 * (t - run.start)) / length}%`;
  track.setAttribute("aria-valuemin", run.start.toFixed(2));
  track.setAttribute("aria-valuemax", run.end.toFixed(2));
  const put = (name, from, to) => {
    const piece = track.insertBefore(document.createElement("div"), head);
    piece.className = name;
    piece.style.left = share(from);
    if (to !== undefined) piece.style.width = `${(100 * (to - from)) / length}%`;
    return piece;
  };
  run.steps.forEach((step, k) => {
    // A narrow step has no room for its padding and name.
    const narrow = (step.end - step.start) / length < 0.03;
    const piece = put(`step${step.outcome === "done" ? "" : " bad"}${narrow ? " narrow" : ""}`, step.start, step.end);
    piece.dataset.step = k;
    if (!narrow) piece.textContent = placed(step).short.replace(/^else\//, "");
    piece.title = `${step.label}: ${step.outcome}${step.text ? "\n" + step.text : ""}`;
    for (const phase of step.phases)
      element(piece, "div", "phase").style.left = `${(100 * (phase.start - step.start)) / (step.end - step.start || 1)}%`;
  });
  for (const [from, to] of run.gaps) put("gap", from, to).title = `no data from ${from.toFixed(2)} to ${to.toFixed(2)} s`;
  for (const mark of run.marks) {
    if (mark.kind === "contact") continue;
    const piece = put("event", mark.time);
    piece.style.background = `var(${MARKS[mark.kind]})`;
    piece.title = `${mark.text} at ${mark.time.toFixed(2)} s`;
  }
  scrub(track, (event) => {
    const box = track.getBoundingClientRect();
    return run.start + ((event.clientX - box.left) / box.width) * length;
  });
}

function build() {
  buildCauses();
  buildSteps();
  buildTrack();
  buildLayers();
  buildPlot();
  buildKeys();
  part("play").addEventListener("click", () => play(!playing));
  const resized = new ResizeObserver(refresh);
  for (const box of [root, part("plot")]) resized.observe(box);
}

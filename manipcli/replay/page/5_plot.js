// The drawing of the plot: everything that stays, drawn once, and over it the time and the pointer.

const MARKS = { failure: "--bad", stop: "--bad", lost: "--bad", replan: "--warn", contact: "--faint", grasp: "--good", release: "--good" };
const still = { canvas: document.createElement("canvas"), key: "" };

function drawPlot() {
  const canvas = part("plot"), ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  if (!wide || !high) return;
  const all = curves(), shown = all.filter((curve) => curve.on), [begin, end] = range();
  const key = [begin, end, wide, high, ratio, plot.table, plot.column, [...plot.hidden], document.documentElement.dataset.scheme].join("|");
  if (still.key !== key) {
    still.key = key;
    [still.canvas.width, still.canvas.height] = [wide * ratio, high * ratio];
    const pen = still.canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "11px system-ui, sans-serif";
    still.at = axes(pen, shown, begin, end, wide, high);
    drawStill(pen, still.at, shown);
  }
  if (canvas.width !== still.canvas.width || canvas.height !== still.canvas.height)
    [canvas.width, canvas.height] = [still.canvas.width, still.canvas.height];
  const pen = canvas.getContext("2d"), { X, upper, lower } = still.at, active = stepAt(time);
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, wide, high);
  pen.save();
  within(pen, still.at);
  if (active) {
    pen.fillStyle = colour("--chosen");
    pen.fillRect(X(active.start), upper, X(active.end) - X(active.start), lower - upper);
  }
  pen.restore();
  pen.drawImage(still.canvas, 0, 0, wide, high);
  pen.save();
  within(pen, still.at);
  upright(pen, X(time), still.at, colour("--accent"), 1.5);
  pen.restore();
  drawPointer(pen, still.at, shown);
  showLegend(all);
}

// Decimals of the multiples of a step.
const digits = (step) => Math.min(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), 6);

// The frame of a plot [CSS pixel] and its two axes.
function axes(pen, shown, begin, end, wide, high) {
  const limit = sharedLimit(shown), [low, top] = extent(shown, begin, end, limit), dy = stride(top - low, Math.max(2, high / 45)), rows = [];
  for (let k = Math.ceil(low / dy); k * dy <= top; k++) rows.push([k * dy, (k * dy).toFixed(k ? digits(dy) : 0)]);
  const left = 10 + Math.max(24, ...rows.map(([, text]) => pen.measureText(text).width)), right = wide - 8, upper = 20, lower = high - 20;
  const X = (t) => left + ((t - begin) / (end - begin || 1)) * (right - left);
  const Y = (v) => lower - ((v - low) / (top - low)) * (lower - upper);
  const T = (x) => begin + ((x - left) / (right - left)) * (end - begin);
  const margins = shown.some((curve) => curve.table.relative);
  return { rows, margins, begin, end, wide, high, low, top, left, right, upper, lower, limit, X, Y, T };
}

function within(pen, { left, right, high }) {
  pen.beginPath(); pen.rect(left, 0, right - left, high); pen.clip();
}

function upright(pen, x, { upper, lower }, style, width, dash = []) {
  pen.strokeStyle = style;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  pen.beginPath(); pen.moveTo(x, upper); pen.lineTo(x, lower); pen.stroke();
  pen.setLineDash([]);
}

function drawStill(pen, at, shown) {
  drawAxes(pen, at, shown);
  pen.save();
  within(pen, at);
  for (const [from, to] of run.gaps) hatch(pen, at.X(from), at.X(to), at);
  for (const step of run.steps) upright(pen, at.X(step.start), at, colour("--faint"), 0.7, [2, 3]);
  drawLimit(pen, at);
  for (const curve of shown) {
    // Before it counts, a margin is thin.
    const [first, last] = rowsWithin(curve, at.begin, at.end);
    const k = curve.since ? Math.min(Math.max(moment(curve.since, curve.table.times)[0], first), last) : first;
    pen.strokeStyle = colour(`--series-${curve.series}`);
    pen.setLineDash(curve.dashed || k > first ? [4, 3] : []);
    pen.lineWidth = k > first ? 0.8 : curve.dashed ? 1.2 : 1.5;
    if (k > first) {
      drawCurve(pen, at, curve, first, k);
      pen.setLineDash([]);
      pen.lineWidth = 2;
    }
    drawCurve(pen, at, curve, k, last);
    pen.setLineDash([]);
  }
  for (const curve of shown) if (curve.tightest) drawTightest(pen, at, curve, shown.length === 1);
  for (const mark of run.marks) {
    const x = at.X(mark.time), style = colour(MARKS[mark.kind]);
    upright(pen, x, at, style, 1, [1, 3]);
    pen.fillStyle = style;
    pen.beginPath(); pen.moveTo(x - 4, at.upper - 7); pen.lineTo(x + 4, at.upper - 7); pen.lineTo(x, at.upper); pen.fill();
  }
  pen.restore();
}

function hatch(pen, x0, x1, { upper, lower }) {
  pen.save();
  pen.beginPath(); pen.rect(x0, upper, x1 - x0, lower - upper); pen.clip();
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 2;
  for (let x = x0 - (lower - upper); x < x1; x += 7) {
    pen.beginPath(); pen.moveTo(x, lower); pen.lineTo(x + lower - upper, upper); pen.stroke();
  }
  pen.restore();
}

function drawAxes(pen, { rows, begin, end, left, right, upper, lower, wide, high, X, Y }, shown) {
  pen.strokeStyle = colour("--rule");
  pen.fillStyle = colour("--faint");
  pen.lineWidth = 1;
  const dx = stride(end - begin || 1, Math.max(2, wide / 70));
  pen.textAlign = "right";
  for (const [v, text] of rows) {
    pen.beginPath(); pen.moveTo(left, Y(v)); pen.lineTo(right, Y(v)); pen.stroke();
    pen.fillText(text, left - 5, Y(v) + 4);
  }
  pen.textAlign = "center";
  for (let k = Math.ceil(begin / dx - 1e-9); k * dx <= end + 1e-9; k++) {
    pen.beginPath(); pen.moveTo(X(k * dx), upper); pen.lineTo(X(k * dx), lower); pen.stroke();
    const text = `${(k * dx).toFixed(digits(dx))} s`;
    pen.fillText(text, Math.min(X(k * dx), wide - pen.measureText(text).width / 2), high - 5);
  }
  const units = [...new Set(shown.map((curve) => curve.unit))].join(", ");
  pen.textAlign = "left";
  pen.fillText(units ? `[${units}]` : "", 4, 11);
}

// Beyond a limit the ground is red; a limit out of the plot is written at its edge.
function drawLimit(pen, { margins, limit, low, top, left, right, upper, lower, Y }) {
  (limit || []).forEach((end, k) => {
    if (end === null) return;
    const text = margins ? "not met" : `limit ${+end.toPrecision(4)}`, y = Y(end);
    pen.fillStyle = colour("--bad");
    pen.textAlign = "right";
    if (end < low || end > top) {
      pen.fillText(`${text} ${k ? "↑" : "↓"}`, right - 4, k ? upper + 12 : lower - 5);
      return;
    }
    pen.globalAlpha = 0.14;
    pen.fillRect(left, k ? upper : y, right - left, k ? y - upper : lower - y);
    pen.globalAlpha = 1;
    pen.strokeStyle = colour("--bad");
    pen.setLineDash([6, 3]);
    pen.beginPath(); pen.moveTo(left, y); pen.lineTo(right, y); pen.stroke();
    pen.setLineDash([]);
    pen.fillText(text, right - 4, k ? y - 4 : y + 12);
  });
}

// Where there are many more rows than pixels, the lowest and the highest of each pixel.
function drawCurve(pen, { X, Y, left, right }, curve, first, last) {
  pen.beginPath();
  const dense = last - first > 4 * (right - left);
  let on = false, column = -1, low = 0, top = 0;
  const flush = () => { if (column >= 0) { pen.lineTo(column, Y(low)); pen.lineTo(column, Y(top)); } column = -1; };
  for (let k = first; k <= last; k++) {
    const v = value(curve, k), x = X(curve.table.times[k]);
    if (Number.isNaN(v)) { flush(); on = false; continue; }
    if (!on) pen.moveTo(x, Y(v));
    else if (!dense) pen.lineTo(x, Y(v));
    if (dense) {
      if (Math.round(x) !== column) { flush(); column = Math.round(x); low = top = v; }
      low = Math.min(low, v);
      top = Math.max(top, v);
    }
    on = true;
  }
  flush();
  pen.stroke();
}

// The deciding moment of an expectation; its value only where it is alone.
function drawTightest(pen, { X, Y, right, upper }, curve, alone) {
  const { at, value: v, met } = curve.tightest, x = X(at), y = Y(v);
  pen.strokeStyle = pen.fillStyle = colour(met ? "--good" : "--bad");
  pen.lineWidth = 2;
  pen.beginPath(); pen.arc(x, y, 5, 0, 2 * Math.PI); pen.stroke();
  if (!alone) return;
  const text = `${readable(v, curve.unit)} at ${at.toFixed(2)} s`, over = x + 10 + pen.measureText(text).width > right;
  pen.textAlign = over ? "right" : "left";
  pen.fillText(text, x + (over ? -9 : 9), Math.max(y - 6, upper + 10));
}

// A line at the pointer, and beside it the time, the step, a mark, and the value of every curve.
function drawPointer(pen, at, shown) {
  const box = part("values"), { pointer } = plot;
  const inside = pointer && pointer.x >= at.left && pointer.x <= at.right;
  box.hidden = !inside;
  if (!inside) return;
  const near = run.marks.filter((mark) => Math.abs(at.X(mark.time) - pointer.x) < 6), t = at.T(pointer.x);
  upright(pen, pointer.x, at, colour("--ink"), 1, [3, 2]);
  const rows = shown.map((curve) => ({ curve, v: valueAt(curve, t) })).filter(({ v }) => !Number.isNaN(v));
  let nearest = null;
  for (const row of rows) {
    row.far = Math.abs(at.Y(row.v) - pointer.y);
    if (!nearest || row.far < nearest.far) nearest = row;
    pen.fillStyle = colour(`--series-${row.curve.series}`);
    pen.beginPath(); pen.arc(pointer.x, at.Y(row.v), 3, 0, 2 * Math.PI); pen.fill();
  }
  const step = stepAt(t);
  box.textContent = "";
  element(box, "b", "", `${t.toFixed(3)} s${step ? `  ${placed(step).short}` : ""}`);
  for (const mark of near) element(box, "div", "mark-text", mark.text).style.color = `var(${MARKS[mark.kind]})`;
  for (const { name, tightest } of shown)
    if (tightest && Math.abs(at.X(tightest.at) - pointer.x) < 6) element(box, "div", "mark-text", `${name}, tightest: ${tightest.text}`);
  for (const row of rows) {
    const line = element(box, "div", row === nearest && rows.length > 1 ? "near" : "");
    element(line, "i").style.background = `var(--series-${row.curve.series})`;
    element(line, "span", "", row.curve.name);
    element(line, "span", "number", readable(row.v, row.curve.unit));
  }
  // On the side of the pointer that has more room.
  const left = pointer.x > (at.left + at.right) / 2;
  box.style.left = left ? "" : `${pointer.x + 10}px`;
  box.style.right = left ? `${at.wide - pointer.x + 10}px` : "";
}

function buildPlot() {
  const canvas = part("plot");
  scrub(canvas, (event) => still.at.T(event.clientX - canvas.getBoundingClientRect().left));
  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect();
    plot.pointer = event.pointerType === "touch" ? null : { x: event.clientX - box.left, y: event.clientY - box.top };
    refresh();
  });
  canvas.addEventListener("pointerleave", () => { plot.pointer = null; refresh(); });
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
    canvas.setAttribute("aria-label", `curves: ${table ? table.name : "none"}`);
    refresh();
  };
  tables.addEventListener("change", fill);
  columns.addEventListener("change", () => { plot.column = Number(columns.value); refresh(); });
  part("span").addEventListener("change", () => { plot.span = Number(part("span").value); refresh(); });
  fill();
}

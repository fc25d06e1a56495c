// The curve plot.

// A colour of the page's variables, as the canvas takes it: their computed value, not their text.
const colours = new Map();
function colour(name) {
  if (!colours.has(name)) {
    const probe = root.appendChild(document.createElement("i"));
    probe.style.color = `var(${name})`;
    colours.set(name, getComputedStyle(probe).color);
    probe.remove();
  }
  return colours.get(name);
}
document.documentElement.addEventListener("scheme", () => { colours.clear(); refresh(); });

const SERIES = 13;
const series = (c) => colour(`--series-${c % SERIES}`);
const plot = { table: 0, column: -1, span: 0 };

// The plotted curves: [name, colour, dashed, values of table, column].
function curves() {
  const table = run.curves[plot.table];
  if (!table) return [];
  if (plot.column < 0) return table.columns.map((name, c) => ({ name, colour: series(c), table, c }));
  const name = table.columns[plot.column], found = [{ name, colour: series(0), table, c: plot.column }];
  const reference = run.curves.find((table) => table.name === "joint reference");
  if (table.name === "joint position" && reference && reference.columns.includes(name))
    found.push({ name: "reference", colour: series(1), dashed: true, table: reference, c: reference.columns.indexOf(name) });
  return found;
}

// Without a negative zero.
const fixed = (v, digits) => v.toFixed(digits).replace(/^-(?=[0.]+$)/, "");

const value = (curve, k) => curve.table.values[k * curve.table.columns.length + curve.c];

function range() {
  if (!plot.span) return [run.start, run.end];
  const begin = Math.min(Math.max(time - 0.7 * plot.span, run.start), Math.max(run.end - plot.span, run.start));
  return [begin, Math.min(begin + plot.span, run.end)];
}

// A step of 1, 2 or 5 times a power of ten that divides `length` into about `count` parts.
function stride(length, count) {
  const raw = length / count, power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5].find((factor) => factor * power >= raw) || 10);
}

function drawPlot() {
  const canvas = part("plot"), ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  if (!wide || !high) return;
  canvas.width = wide * ratio;
  canvas.height = high * ratio;
  const pen = canvas.getContext("2d"), shown = curves(), [begin, end] = range();
  pen.scale(ratio, ratio);
  pen.font = "11px system-ui, sans-serif";
  const first = moment(begin)[0], last = Math.min(moment(end)[0] + 1, stamps.length - 1);
  let low = Infinity, top = -Infinity;
  for (const curve of shown)
    for (let k = first; k <= last; k++) {
      const v = value(curve, k);
      if (v < low) low = v;
      if (v > top) top = v;
    }
  if (!(low <= top)) [low, top] = [0, 1];
  const room = Math.max((top - low) * 0.06, 1e-9 + Math.abs(top) * 1e-6);
  low -= room;
  top += room;
  const left = 46, right = wide - 8, upper = 6, lower = high - 20;
  const X = (t) => left + ((t - begin) / (end - begin || 1)) * (right - left);
  const Y = (v) => lower - ((v - low) / (top - low)) * (lower - upper);
  plot.at = (x) => begin + ((x - left) / (right - left)) * (end - begin);
  pen.strokeStyle = colour("--rule");
  pen.fillStyle = colour("--faint");
  pen.lineWidth = 1;
  const dy = stride(top - low, Math.max(2, high / 45)), dx = stride(end - begin || 1, Math.max(2, wide / 70));
  const digits = Math.max(0, -Math.floor(Math.log10(dy) + 1e-9));
  pen.textAlign = "right";
  for (let v = Math.ceil(low / dy) * dy; v <= top; v += dy) {
    pen.beginPath(); pen.moveTo(left, Y(v)); pen.lineTo(right, Y(v)); pen.stroke();
    pen.fillText(Math.abs(v) < dy / 1e6 ? "0" : v.toFixed(Math.min(digits, 6)), left - 5, Y(v) + 4);
  }
  pen.textAlign = "center";
  for (let t = Math.ceil(begin / dx) * dx; t <= end; t += dx) {
    pen.beginPath(); pen.moveTo(X(t), upper); pen.lineTo(X(t), lower); pen.stroke();
    const text = +t.toFixed(6) + " s";
    pen.fillText(text, Math.min(X(t), wide - pen.measureText(text).width / 2), high - 5);
  }
  pen.save();
  pen.beginPath(); pen.rect(left, 0, right - left, high); pen.clip();
  const active = stepAt(time);
  if (active) {
    pen.fillStyle = colour("--chosen");
    pen.fillRect(X(active.start), upper, X(active.end) - X(active.start), lower - upper);
  }
  for (const curve of shown) {
    pen.strokeStyle = curve.colour;
    pen.lineWidth = curve.dashed ? 1.2 : 1.5;
    pen.setLineDash(curve.dashed ? [4, 3] : []);
    pen.beginPath();
    let on = false;
    for (let k = first; k <= last; k++) {
      const v = value(curve, k);
      if (Number.isNaN(v)) { on = false; continue; }
      if (on) pen.lineTo(X(stamps[k]), Y(v)); else pen.moveTo(X(stamps[k]), Y(v));
      on = true;
    }
    pen.stroke();
  }
  pen.setLineDash([]);
  pen.strokeStyle = colour("--accent");
  pen.lineWidth = 1.5;
  pen.beginPath(); pen.moveTo(X(time), upper); pen.lineTo(X(time), lower); pen.stroke();
  pen.restore();
  const legend = part("legend"), [k, fraction] = moment(time);
  while (legend.childElementCount > shown.length) legend.lastChild.remove();
  shown.forEach((curve, c) => {
    let entry = legend.children[c];
    if (!entry) {
      entry = legend.appendChild(document.createElement("span"));
      entry.append(document.createElement("i"), document.createElement("span"));
    }
    const v = between(curve.table.values, curve.table.columns.length, curve.c, k, fraction);
    entry.firstChild.style.background = curve.colour;
    const text = Number.isNaN(v) ? "–" : Math.abs(v) >= 100 ? fixed(v, 1) : fixed(v, Math.abs(v) < 0.1 ? 4 : 3);
    entry.lastChild.textContent = `${curve.name} ${text} ${curve.table.units[curve.c]}`;
  });
}

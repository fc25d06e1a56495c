// What the plot shows: one table of curves, some of its series, their limits.

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
// `hidden`: series that the legend switched off; `pointer`: of the mouse over the plot [CSS pixel].
const plot = { table: 0, column: -1, span: 0, hidden: new Set(), pointer: null };

// The curves of the chosen table, and for one joint its reference.
function curves() {
  const table = run.curves[plot.table];
  if (!table) return [];
  const curve = (table, c, more = {}) => ({ name: table.columns[c], key: `${table.name}/${table.columns[c]}`, series: c % SERIES,
    table, c, values: table.values, unit: table.units[c], limit: table.limits[c], tightest: table.tightest && table.tightest[c],
    since: table.since && table.since[c], ...more });
  let found = plot.column < 0 ? table.columns.map((_, c) => curve(table, c)) : [curve(table, plot.column, { series: 0 })];
  if (plot.column >= 0 && table.name === "joint position") {
    const reference = run.curves.find((other) => other.name === "joint reference");
    const c = reference ? reference.columns.indexOf(table.columns[plot.column]) : -1;
    if (c >= 0) found.push(curve(reference, c, { name: "reference", series: 1, dashed: true }));
  }
  found.forEach((one) => { one.on = !plot.hidden.has(one.key); });
  // Margins of several units are compared in tolerances.
  if (table.relative && new Set(found.filter((one) => one.on).map((one) => one.unit)).size > 1) {
    found = found.map((one) => ({ ...one, values: table.relative, unit: "tolerances",
      tightest: one.tightest && { ...one.tightest, value: one.tightest.relative } }));
  }
  return found;
}

const value = (curve, k) => curve.values[k * curve.table.columns.length + curve.c];

// Value at a time; NaN where none is known.
function valueAt(curve, t) {
  const [k, fraction] = moment(t, curve.table.times);
  return between(curve.values, curve.table.columns.length, curve.c, k, fraction);
}

// Without a negative zero.
const fixed = (v, digits) => v.toFixed(digits).replace(/^-(?=[0.]+$)/, "");
const readable = (v, unit) =>
  Number.isNaN(v) ? "–" : `${Math.abs(v) >= 100 ? fixed(v, 1) : fixed(v, Math.abs(v) < 0.1 ? 4 : 3)} ${unit}`;

// The limit that all these curves share; null if they differ or have none.
function sharedLimit(shown) {
  const [first] = shown;
  if (!first || !first.limit) return null;
  const same = shown.every(({ limit }) => limit && limit[0] === first.limit[0] && limit[1] === first.limit[1]);
  return same ? first.limit : null;
}

function range() {
  if (!plot.span) return [run.start, run.end];
  const begin = Math.min(Math.max(time - 0.7 * plot.span, run.start), Math.max(run.end - plot.span, run.start));
  return [begin, Math.min(begin + plot.span, run.end)];
}

// The first and the last row of a curve that are needed from `begin` to `end`.
function rowsWithin({ table }, begin, end) {
  return [moment(begin, table.times)[0], Math.min(moment(end, table.times)[0] + 1, table.times.length - 1)];
}

// Lowest and highest value from `begin` to `end`, with room around; a limit that is near is within, and that
// of margins always.
function extent(shown, begin, end, limit) {
  let low = Infinity, top = -Infinity;
  for (const curve of shown) {
    const [first, last] = rowsWithin(curve, begin, end);
    for (let k = first; k <= last; k++) {
      const v = value(curve, k);
      if (v < low) low = v;
      if (v > top) top = v;
    }
  }
  if (!(low <= top)) [low, top] = [0, 1];
  const size = shown.some((curve) => curve.table.relative) ? Infinity : Math.max(top - low, 1e-9);
  for (const end of limit || []) {
    if (end === null) continue;
    if (end < low && low - end < 2 * size) low = end;
    if (end > top && end - top < 2 * size) top = end;
  }
  const room = Math.max((top - low) * 0.06, 1e-9 + Math.abs(top) * 1e-6);
  return [low - room, top + room];
}

// A step of 1, 2 or 5 times a power of ten that divides `length` into about `count` parts.
function stride(length, count) {
  const raw = length / count, power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5].find((factor) => factor * power >= raw) || 10);
}

function choose(table, column) {
  const k = run.curves.findIndex((one) => one.name === table);
  if (k < 0) return;
  part("table").value = k;
  part("table").dispatchEvent(new Event("change"));
  part("column").value = run.curves[k].columns.indexOf(column);
  part("column").dispatchEvent(new Event("change"));
}

// The legend: a switch for each curve, with its value now.
function showLegend(shown) {
  const legend = part("legend");
  while (legend.childElementCount > shown.length) legend.lastChild.remove();
  shown.forEach((curve, c) => {
    let entry = legend.children[c];
    if (!entry) {
      entry = element(legend, "button");
      entry.type = "button";
      element(entry, "i");
      element(entry, "span");
      entry.addEventListener("click", () => {
        if (!plot.hidden.delete(entry.dataset.key)) plot.hidden.add(entry.dataset.key);
        refresh();
      });
    }
    entry.dataset.key = curve.key;
    entry.setAttribute("aria-pressed", curve.on);
    entry.title = curve.on ? "hide" : "show";
    entry.firstChild.style.background = `var(--series-${curve.series})`;
    entry.lastChild.textContent = `${curve.name} ${readable(valueAt(curve, time), curve.unit)}`;
  });
}

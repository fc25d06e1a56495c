"use strict";
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const byId = (id) => document.getElementById(id);
  if (!byId("small")) return;
  const LETTER = 7;  // width of a letter of a label
  const SVG = "http://www.w3.org/2000/svg";
  const drawn = new Map();  // marks of each sample, in all plots
  let chosen = null;

  function svg(name, attributes, ...children) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  }

  function html(name, attributes, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  }

  function short(value) {
    if (value === null) return "–";
    return String(Number(value.toPrecision(4))).replace("-", "−");
  }

  /** A mark at (x, y): a disc if the sample passed, a cross if not. */
  function mark(sample, x, y) {
    const shape = sample.passed
      ? svg("circle", { cx: x, cy: y, r: 4 })
      : svg("path", { d: `M${x - 3.5} ${y - 3.5}l7 7m0 -7l-7 7` });
    const found = svg("g", { tabindex: 0, role: "button", "aria-label": `sample ${sample.number}, ${sample.outcome}` },
      svg("title", {}, `sample ${sample.number}: ${sample.outcome}`),
      svg("rect", { class: "hit", x: x - 6, y: y - 6, width: 12, height: 12 }), shape);
    found.addEventListener("click", () => choose(sample));
    found.addEventListener("keydown", (event) => { if (event.key === "Enter") choose(sample); });
    if (!drawn.has(sample.number)) drawn.set(sample.number, []);
    drawn.get(sample.number).push(found);
    return found;
  }

  function range(values) {
    let low = Math.min(...values), high = Math.max(...values);
    if (low === high) { low -= Math.abs(low) * 0.1 || 1; high += Math.abs(high) * 0.1 || 1; }
    const room = (high - low) * 0.06;
    return [low - room, high + room];
  }

  /** A scatter plot; `x` and `y` give a number or null. */
  function plot(width, height, x, y, lines) {
    const bottom = 24, top = 8, right = 10;
    const shown = data.samples.filter((s) => x(s) !== null && y(s) !== null);
    // The labels of y are as wide as their text.
    const ends = shown.length ? [Math.min(...shown.map(y)), Math.max(...shown.map(y))].map(short) : [];
    const left = Math.max(52, 12 + LETTER * Math.max(0, ...ends.map((text) => text.length)));
    const whole = svg("svg", { class: "plot", viewBox: `0 0 ${width} ${height}` });
    if (!shown.length) return whole;
    const [x0, x1] = range([...shown.map(x), ...(lines.nominal === undefined ? [] : [lines.nominal])]);
    const [y0, y1] = range([...shown.map(y), ...(lines.up === undefined ? [] : [lines.up])]);
    const px = (v) => left + (v - x0) / (x1 - x0) * (width - left - right);
    const py = (v) => height - bottom - (v - y0) / (y1 - y0) * (height - bottom - top);
    const line = (name, a, b, c, d) => svg("line", { class: name, x1: a, y1: b, x2: c, y2: d });
    const label = (text, a, b, anchor) => svg("text", { x: a, y: b, "text-anchor": anchor }, text);
    whole.append(line("axis", left, height - bottom, width - right, height - bottom), line("axis", left, top, left, height - bottom));
    if (lines.zero && y0 < 0 && y1 > 0) whole.append(line("zero", left, py(0), width - right, py(0)));
    if (lines.nominal !== undefined) whole.append(line("nominal", px(lines.nominal), top, px(lines.nominal), height - bottom));
    if (lines.up !== undefined) whole.append(line("nominal", left, py(lines.up), width - right, py(lines.up)));
    const xs = shown.map(x), ys = shown.map(y);
    const [xa, xb, ya, yb] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    whole.append(label(short(xa), px(xa), height - 8, "start"));
    if (xa !== xb) whole.append(label(short(xb), px(xb), height - 8, "end"));
    whole.append(label(short(ya), left - 5, py(ya) + 4, "end"));
    if (ya !== yb) whole.append(label(short(yb), left - 5, py(yb) + 4, "end"));
    for (const s of [...shown].sort((a, b) => b.passed - a.passed)) whole.append(mark(s, px(x(s)), py(y(s))));
    return whole;
  }

  /** A command and a button that copies it; where the browser refuses that, it is selected. */
  function command(text) {
    const written = html("pre", {}, text), copy = html("button", { type: "button" }, "Copy");
    const select = () => { getSelection().selectAllChildren(written); copy.textContent = "Selected"; };
    copy.addEventListener("click", () => navigator.clipboard
      ? navigator.clipboard.writeText(text).then(() => { copy.textContent = "Copied"; }, select) : select());
    return [written, copy];
  }

  const named = (one) => one.unit ? `${one.name} [${one.unit}]` : one.name;

  function choose(sample) {
    chosen = sample;
    for (const [number, marks] of drawn) {
      for (const each of marks) each.classList.toggle("chosen", number === sample.number);
    }
    const rows = (names, values) => names.map((one, k) => html("tr", {}, html("td", {}, one.name), html("td", { class: "n" }, `${short(values[k])} ${values[k] === null ? "" : one.unit}`)));
    byId("sample").replaceChildren(
      html("h4", {}, `Sample ${sample.number}: ${sample.outcome}`),
      ...(sample.cause ? [html("p", {}, sample.cause)] : []),
      ...command(sample.command),
      ...(sample.link ? [html("p", {}, "Replay its ", html("a", { href: sample.link }, "log"), ":"), ...command(sample.replay)] : []),
      html("table", {}, html("tbody", {}, ...rows(data.numbers, sample.values), ...rows(data.margins, sample.margins))));
  }

  function redraw() {
    drawn.clear();
    const of = Number(byId("margin").value);
    const margin = (s) => s.margins[of];
    byId("small").replaceChildren(...data.numbers.map((number, k) => html("figure", {},
      plot(300, 200, (s) => s.values[k], margin, { zero: true, nominal: number.nominal }), html("figcaption", {}, named(number)))));
    const a = Number(byId("first").value), b = Number(byId("second").value);
    byId("map").replaceChildren(plot(620, 420, (s) => s.values[a], (s) => s.values[b],
      { nominal: data.numbers[a].nominal, up: data.numbers[b].nominal }));
    if (chosen) choose(chosen);
  }

  function fill(id, names, value) {
    byId(id).append(...names.map((one, k) => html("option", { value: k }, named(one))));
    byId(id).value = String(value);
    byId(id).addEventListener("change", redraw);
  }

  if (!data.numbers.length) return;
  fill("margin", data.margins, 0);
  fill("first", data.numbers, data.map[0]);
  fill("second", data.numbers, data.map[data.map.length - 1]);
  byId("sample").textContent = "Click a sample.";
  redraw();
})();

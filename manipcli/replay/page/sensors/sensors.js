// Sensors in step with the time: pictures of cameras, forces on taxels, rays of range finders. What is shown at a time
// is what had arrived last.

const RAYS = [`#version 300 es
in vec3 place; uniform mat4 all; uniform float size;
void main() { gl_Position = all * vec4(place, 1.0); gl_PointSize = size; }`, `#version 300 es
precision highp float;
uniform vec4 colour; out vec4 shown;
void main() { shown = vec4(colour.rgb * colour.a, colour.a); }`];
const NEAR_TO_FAR = [[255, 226, 110], [243, 132, 62], [190, 51, 102], [96, 28, 122], [22, 16, 66]];
const WEAK_TO_STRONG = [[238, 241, 245], [250, 205, 120], [240, 120, 50], [190, 30, 60], [90, 10, 60]];
const NOT_MEASURED = [227, 231, 236], UNKNOWN = 65535;
const feeds = [];
let fan = null;

// Index of the last of these times that is not after t; -1 before the first one.
function arrived(times, t) {
  let low = -1, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t + 1e-6) low = middle; else high = middle - 1;
  }
  return low;
}

function shade(colours, part) {
  const at = Math.min(Math.max(part, 0), 1) * (colours.length - 1), k = Math.min(Math.floor(at), colours.length - 2);
  return colours[k].map((c, i) => Math.round(c + (at - k) * (colours[k + 1][i] - c)));
}

const css = (rgb) => `rgb(${rgb.join(" ")})`;

function card(strip, name, note) {
  const made = element(strip, "figure"), head = element(made, "figcaption");
  element(head, "b", "", name);
  const canvas = element(made, "canvas"), below = element(made, "div", "scale");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", name);
  canvas.addEventListener("click", () => { strip.classList.toggle("large"); refresh(); });
  const line = element(made, "div", "note", note);
  return { made, head, canvas, below, line };
}

function scale(below, colours, low, top) {
  below.textContent = "";
  element(below, "span", "", low);
  element(below, "i").style.background = `linear-gradient(to right, ${colours.map(css).join(", ")})`;
  element(below, "span", "", top);
}

function cameraFeed(strip, camera) {
  const { made, head, canvas, below, line } = card(strip, camera.name, ""), pen = canvas.getContext("2d", { willReadFrequently: true });
  let choice = null, wanted = "";
  if (camera.streams.length > 1) {
    choice = element(head, "select");
    choice.setAttribute("aria-label", "picture of " + camera.name);
    camera.streams.forEach((stream, k) => { element(choice, "option", "", stream.name).value = k; });
    choice.addEventListener("change", refresh);
  }
  const clock = element(head, "span");
  for (const stream of camera.streams) {
    stream.times = array(stream.times);
    stream.first = array(stream.first);
    stream.bytes = array(stream.bytes);
    if (stream.kind !== "depth") continue;
    [stream.low, stream.high] = [array(stream.low), array(stream.high)];
    // A picture without any depth has both at 0.
    [stream.nearest, stream.farthest] = [Math.min(...stream.low.filter((z) => z > 0)), Math.max(...stream.high)];
    if (!(stream.nearest < stream.farthest)) [stream.nearest, stream.farthest] = [0, 1];
  }
  const dress = (stream) => {
    [canvas.width, canvas.height] = stream.size;
    line.textContent = stream.note;
    below.textContent = "";
    if (stream.kind === "depth") scale(below, NEAR_TO_FAR, stream.nearest.toFixed(2) + " m", stream.farthest.toFixed(2) + " m");
  };
  const colour = (stream, k) => {
    const image = pen.getImageData(0, 0, canvas.width, canvas.height), pixels = image.data, table = [];
    for (let level = 0; level < 256; level++) {
      const z = stream.low[k] + (level / 255) * (stream.high[k] - stream.low[k]);
      table.push(shade(NEAR_TO_FAR, (z - stream.nearest) / (stream.farthest - stream.nearest)));
    }
    for (let j = 0; j < pixels.length; j += 4)
      [pixels[j], pixels[j + 1], pixels[j + 2], pixels[j + 3]] = pixels[j + 3] ? [...table[pixels[j]], 255] : [...NOT_MEASURED, 255];
    pen.putImageData(image, 0, 0);
  };
  return async (t) => {
    const number = choice ? Number(choice.value) : 0, stream = camera.streams[number], k = arrived(stream.times, t);
    if (wanted === `${number}/${k}`) return;
    const key = wanted = `${number}/${k}`;
    if (k < 0) {
      dress(stream);
      clock.textContent = "nothing arrived yet";
      return;
    }
    const bytes = stream.bytes.subarray(stream.first[k], stream.first[k + 1]);
    const bitmap = await createImageBitmap(new Blob([bytes], { type: stream.kind === "labels" ? "image/png" : "image/webp" }));
    if (wanted !== key) return;
    dress(stream);
    pen.drawImage(bitmap, 0, 0);
    if (stream.kind === "depth") colour(stream, k);
    clock.textContent = `arrived ${stream.times[k].toFixed(2)} s`;
    made.dataset.shown = stream.times[k];
  };
}

function taxelFeed(strip, grid) {
  const { made, head, canvas, below } = card(strip, grid.name, grid.note), pen = canvas.getContext("2d");
  const clock = element(head, "span"), times = array(grid.times), counts = array(grid.counts), n = grid.rows * grid.columns;
  let most = 0, before = NaN;
  for (const count of counts) if (count !== UNKNOWN && count > most) most = count;
  const [w, h] = grid.cell, side = Math.min(180 / (grid.rows * h), 300 / (grid.columns * w));
  const wide = Math.max(side * w, 1), high = Math.max(side * h, 1);
  [canvas.width, canvas.height] = [2 * grid.columns * wide, 2 * grid.rows * high];
  scale(below, WEAK_TO_STRONG, "0 N", `${(most * grid.unit || 1).toPrecision(3)} N`);
  return (t) => {
    const k = arrived(times, t);
    if (k === before) return;
    before = k;
    let sum = 0;
    pen.clearRect(0, 0, canvas.width, canvas.height);
    for (let cell = 0; cell < n; cell++) {
      const count = k < 0 ? UNKNOWN : counts[k * n + cell];
      if (count !== UNKNOWN) sum += count * grid.unit;
      pen.fillStyle = css(count === UNKNOWN ? NOT_MEASURED : shade(WEAK_TO_STRONG, count / (most || 1)));
      // The first row is that of the lowest y.
      const row = grid.rows - 1 - Math.floor(cell / grid.columns), column = cell % grid.columns;
      pen.fillRect(2 * column * wide + 1, 2 * row * high + 1, Math.max(2 * wide - 2, 1), Math.max(2 * high - 2, 1));
    }
    clock.textContent = k < 0 ? "nothing arrived yet" : `sum ${fixed(sum, 2)} N`;
    made.dataset.shown = k < 0 ? "" : times[k];
  };
}

// Line segments along the rays of a range finder where it was at the time of measuring; null if nothing is shown.
function beams(finder, t) {
  const k = arrived(finder.times, t), n = finder.angles.length, found = [];
  if (k < 0) return null;
  const frame = poses(measured, finder.taken[k])[finder.frame];
  const p = add(frame.p, turn(frame.q, finder.p)), q = mul(frame.q, finder.q);
  for (let j = 0; j < n; j++) {
    const count = finder.counts[k * n + j], angle = finder.angles[j];
    if (count === UNKNOWN) continue;
    found.push(...p, ...add(p, turn(q, times([Math.cos(angle), Math.sin(angle), 0], count * finder.unit))));
  }
  return new Float32Array(found);
}

function drawRays(all, t) {
  if (!fan) {
    fan = { program: program(RAYS), vao: gl.createVertexArray(), buffer: gl.createBuffer() };
    gl.bindVertexArray(fan.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, fan.buffer);
    attribute(fan.program, "place", 3, gl.FLOAT, false, 12);
  }
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  gl.useProgram(fan.program.made);
  gl.uniformMatrix4fv(fan.program.all, false, all);
  gl.bindVertexArray(fan.vao);
  gl.bindBuffer(gl.ARRAY_BUFFER, fan.buffer);
  gl.depthMask(false);
  for (const finder of run.senses.rays) {
    const ends = beams(finder, t);
    if (!ends || !ends.length) continue;
    gl.bufferData(gl.ARRAY_BUFFER, ends, gl.DYNAMIC_DRAW);
    gl.uniform4f(fan.program.colour, 0.86, 0.1, 0.35, Math.min(0.9, Math.max(0.07, 30 / finder.angles.length)));
    gl.drawArrays(gl.LINES, 0, ends.length / 3);
    // Every second point is an end.
    attribute(fan.program, "place", 3, gl.FLOAT, false, 24, 12);
    gl.uniform1f(fan.program.size, 3 * ratio);
    gl.uniform4f(fan.program.colour, 0.86, 0.1, 0.2, 0.95);
    gl.drawArrays(gl.POINTS, 0, ends.length / 6);
    attribute(fan.program, "place", 3, gl.FLOAT, false, 12);
  }
  gl.depthMask(true);
}

function furnishSenses() {
  const { cameras, taxels, rays, notes } = run.senses;
  const strip = document.createElement("div");
  strip.className = "senses";
  if (cameras.length + taxels.length + notes.length) root.querySelector(".side").before(strip);
  feeds.push(...cameras.map((camera) => cameraFeed(strip, camera)), ...taxels.map((grid) => taxelFeed(strip, grid)));
  for (const finder of rays)
    for (const name of ["angles", "times", "taken", "counts"]) finder[name] = array(finder[name]);
  const remarks = [...notes, ...rays.filter((finder) => finder.note).map((finder) => `${finder.name}: ${finder.note}`)];
  if (remarks.length && strip.parentNode) element(strip, "div", "note", remarks.join("\n"));
  if (rays.length) {
    switches.push(["sensors", "rays", "rays", remarks.join("\n") || "distances that range finders measured", () => true]);
    shows.rays = true;
  }
  // For scripts and tests.
  root.beams = (t) => rays.map((finder) => [...(beams(finder, t) || [])]);
}

build = ((before) => () => { furnishSenses(); before(); })(build);
overlays.push((all) => { if (shows.rays) drawRays(all, time); });
showStatus = ((before) => () => {
  before();
  for (const feed of feeds) Promise.resolve(feed(time)).catch(() => {});
})(showStatus);

// Labels over the scene: names of frames, numbers of forces and masses, and the scale of the forces.

// The forces at a time, one for each pair of parts: their sum, and where it acts.
function pairForces(now, t) {
  if (!run.pushes) return [];
  const found = new Map();
  for (const push of pushesAt(now, t)) {
    const weight = Math.hypot(...push.normal);
    const pair = found.get(push.pair) || { force: [0, 0, 0], p: [0, 0, 0], weight: 0, names: run.pushes.pairs[push.pair] };
    pair.force = add(pair.force, add(push.normal, push.friction));
    pair.p = add(pair.p, times(push.p, weight));
    pair.weight += weight;
    found.set(push.pair, pair);
  }
  return [...found.values()].map(({ force, p, weight, names }) => ({ force, p: times(p, 1 / weight), names }));
}

const newtons = (size) => `${size < 10 ? size.toFixed(2) : size < 100 ? size.toFixed(1) : size.toFixed(0)} N`;
const kilograms = (mass) => (mass < 1 ? `${+(1000 * mass).toPrecision(3)} g` : `${+mass.toPrecision(3)} kg`);

// What is written where: { p, text, kind, frame }.
function notes(now, t) {
  const found = [];
  if (shows.frames)
    for (const axes of run.axes) if (!hiddenFrames.has(axes)) found.push({ p: axisPose(axes, now).p, text: axes.name, kind: "frame", frame: axes.frame });
  if (shows.mass) {
    for (const each of run.inertias) found.push({ p: placedIn(each, now).p, text: kilograms(each.mass), kind: "mass" });
    const whole = robotMass(now);
    if (whole) found.push({ p: whole.p, text: `robot ${kilograms(whole.mass)}`, kind: "mass" });
  }
  if (shows.forces && shows.numbers)
    for (const { force, p, names } of pairForces(now, t)) found.push({ p, text: `${newtons(Math.hypot(...force))} on ${names[0]} from ${names[1]}`, kind: "force" });
  return found;
}

function label(all, now, models, t) {
  const tags = part("tags"), { clientWidth: wide, clientHeight: high } = gl.canvas, written = notes(now, t);
  while (tags.childElementCount > written.length) tags.lastChild.remove();
  while (tags.childElementCount < written.length) tags.appendChild(document.createElement("div"));
  const frames = written.some((note) => note.kind === "frame"), [w, h] = [Math.ceil(wide / 4), Math.ceil(high / 4)];
  if (frames) see(w, h, all, models, visible());
  const taken = [];
  written.forEach((note, k) => {
    const at = [0, 1, 2, 3].map((c) => all[c] * note.p[0] + all[4 + c] * note.p[1] + all[8 + c] * note.p[2] + all[12 + c]);
    const [x, y, z] = [at[0] / at[3] / 2 + 0.5, at[1] / at[3] / 2 + 0.5, at[2] / at[3] / 2 + 0.5], tag = tags.children[k];
    // A frame is often inside of its own link, or at the joint in the one above: these do not hide it.
    const front = note.kind === "frame" ? seenAt(x * w, y * h) : null, own = front && [note.frame, run.frames[note.frame].parent].includes(front.frame);
    tag.className = `tag ${note.kind}`;
    if (tag.textContent !== note.text) tag.textContent = note.text;
    let [left, top] = [Math.round(Math.min(x * wide + 6, wide - 6.5 * note.text.length - 12)), Math.round((1 - y) * high + 3)];
    // Labels at one place are below each other, as far as there is room.
    const full = () => taken.some(([l, t]) => Math.abs(l - left) < 70 && Math.abs(t - top) < 16);
    for (let row = 0; row < 3 && full(); row++) top += 16;
    const shown = at[3] > 0 && z < 1 && !(front && !own && front.depth < z) && !full();
    if (shown) taken.push([left, top]);
    tag.style.display = shown ? "" : "none";
    tag.style.transform = `translate(${left}px, ${top}px)`;
  });
  showScale(high);
}

// A bar as long as the arrow of a round force at the distance of the target.
function showScale(high) {
  const bar = part("scale");
  bar.hidden = !(shows.forces && run.pushes);
  if (bar.hidden) return;
  const { half } = projection(gl.canvas.clientWidth / high), pixels = (run.pushes.scale * sizes.force * high) / (2 * half);
  const most = run.pushes.longest / run.pushes.scale, force = roundBelow(Math.min(90 / pixels, most));
  bar.firstChild.style.width = `${force * pixels}px`;
  bar.lastChild.textContent = `${+force.toPrecision(3)} N`;
}

// The largest of 1, 2 or 5 times a power of ten that is not above a number.
function roundBelow(number) {
  const power = 10 ** Math.floor(Math.log10(number) + 1e-9);
  return power * [5, 2, 1].find((factor) => factor * power <= number * (1 + 1e-9));
}

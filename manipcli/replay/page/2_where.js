// Vectors, quaternions and the kinematics of the robot.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => times(a, 1 / (Math.hypot(a[0], a[1], a[2]) || 1));
const mul = (a, b) => [
  a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
  a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
  a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
  a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
];
const turn = (q, v) => {
  const t = times(cross(q, v), 2);
  return add(add(v, times(t, q[3])), cross(q, t));
};

// The gap of the log around t, [start, end]; undefined outside.
const gapAt = (t) => run.gaps.find(([from, to]) => from < t && t < to);

// Index of the last of these times that is not after t, and the fraction from it to the next time, 0 to 1; in a gap the
// state before it is held.
function moment(t, marks = stamps) {
  let low = 0, high = marks.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (marks[middle] <= t) low = middle; else high = middle;
  }
  if (high === low || (marks === stamps && gapAt(t))) return [low, 0];
  const way = (t - marks[low]) / (marks[high] - marks[low] || 1);
  return way >= 1 ? [high, 0] : [low, Math.max(way, 0)];
}

// Values of a table interpolated between row k and row k + 1.
function between(table, width, column, k, way) {
  const a = table[k * width + column];
  return way === 0 ? a : a + way * (table[(k + 1) * width + column] - a);
}

// Pose {p, q} of every frame at time t, with the joints at the values of `joints`, a (T, n) table, and the movable
// bodies at those of `moved`, a (T, 7 m) table.
function poses(joints, t, moved = bodies) {
  const [k, way] = moment(t), n = run.joints.length, found = [];
  for (const f of run.order) {
    const frame = run.frames[f];
    if (frame.body !== undefined) {
      const at = (c) => between(moved, 7 * run.bodies, 7 * frame.body + c, k, 0);
      const p = [0, 1, 2].map((c) => between(moved, 7 * run.bodies, 7 * frame.body + c, k, way));
      let q = [3, 4, 5, 6].map(at);
      if (way > 0) {
        const next = [3, 4, 5, 6].map((c) => moved[(k + 1) * 7 * run.bodies + 7 * frame.body + c]);
        const sign = q[0] * next[0] + q[1] * next[1] + q[2] * next[2] + q[3] * next[3] < 0 ? -1 : 1;
        q = q.map((value, c) => (1 - way) * value + way * sign * next[c]);
        const length = Math.hypot(...q);
        q = q.map((value) => value / length);
      }
      found[f] = { p, q };
      continue;
    }
    let p = frame.p, q = frame.q;
    if (frame.joint !== undefined) {
      const value = between(joints, n, frame.joint, k, way);
      if (frame.slides) {
        p = add(p, turn(q, times(frame.axis, value)));
      } else {
        q = mul(q, [...times(frame.axis, Math.sin(value / 2)), Math.cos(value / 2)]);
      }
    }
    const above = frame.parent === undefined ? null : found[frame.parent];
    found[f] = above ? { p: add(above.p, turn(above.q, p)), q: mul(above.q, q) } : { p, q };
  }
  return found;
}

// Column-major 4 x 4 of a pose, scaled along its axes.
function matrix({ p, q }, s = [1, 1, 1]) {
  const x = times(turn(q, [1, 0, 0]), s[0]), y = times(turn(q, [0, 1, 0]), s[1]), z = times(turn(q, [0, 0, 1]), s[2]);
  return new Float32Array([...x, 0, ...y, 0, ...z, 0, ...p, 1]);
}

function product(a, b) {
  const c = new Float32Array(16);
  for (let j = 0; j < 4; j++)
    for (let i = 0; i < 4; i++)
      for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

// The pose whose z axis points along a direction.
function along(p, direction) {
  const [x, y, z] = unit(direction);
  const q = z < -0.999999 ? [1, 0, 0, 0] : [-y, x, 0, 1 + z];
  const length = Math.hypot(...q);
  return { p, q: q.map((value) => value / length) };
}

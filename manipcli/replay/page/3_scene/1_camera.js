// The camera: where it is, what it projects, and its changes.

const camera = { target: [...run.camera.target], distance: 1, yaw: 0, pitch: 0, parallel: false, follows: "", followed: null, glide: null };
const SLOPE = Math.tan((run.camera.field * Math.PI) / 360);

// The first view: yaw 0 is the front of a robot that faces along x.
function firstView() {
  const back = sub(run.camera.eye, run.camera.target), distance = Math.hypot(...back);
  return { target: run.camera.target, distance, yaw: Math.atan2(back[1], back[0]), pitch: Math.asin(back[2] / distance) };
}

// From above, x of the world is up on the screen.
const VIEWS = { top: { yaw: Math.PI, pitch: Math.PI / 2 }, front: { yaw: 0, pitch: 0 }, side: { yaw: Math.PI / 2, pitch: 0 } };

function look(view = firstView()) {
  Object.assign(camera, { ...view, target: [...(view.target || camera.target)], glide: null });
}

// Moves to another view within 0.25 s.
function glideTo(view) {
  // What an unfinished change does not share with this one still comes true.
  const { target, distance, yaw, pitch } = camera, to = { target, distance, yaw, pitch, ...(camera.glide ? camera.glide.to : {}), ...view };
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) { look(to); return refresh(); }
  // The shorter way around.
  to.yaw = yaw + Math.atan2(Math.sin(to.yaw - yaw), Math.cos(to.yaw - yaw));
  camera.glide = { from: { target, distance, yaw, pitch }, to, since: performance.now() };
  refresh();
}

function glideOn() {
  const { from, to, since } = camera.glide, part = Math.min((performance.now() - since) / 250, 1), s = part * part * (3 - 2 * part);
  camera.target = add(times(from.target, 1 - s), times(to.target, s));
  for (const name of ["distance", "yaw", "pitch"]) camera[name] = from[name] + s * (to[name] - from[name]);
  if (part === 1) camera.glide = null;
  else setTimeout(refresh);
}

// Directions of the camera in the world; `right` is level, so that the view from above is a view like any other.
function directions() {
  const { yaw, pitch } = camera, back = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
  const right = [-Math.sin(yaw), Math.cos(yaw), 0];
  return { back, right, up: cross(back, right) };
}

// `all` maps the world to the screen; half of the screen's height at the target is `half` [m]; `depth` is the distance
// from the eye along the line of sight of a value of the depth buffer.
function projection(aspect) {
  const { back, right, up } = directions(), { distance, target } = camera, eye = add(target, times(back, distance));
  const view = new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
  // The field of view is that of the shorter side, so that a narrow window shows everything.
  const half = (distance * SLOPE) / Math.min(1, aspect);
  const beyond = Math.hypot(...sub(target, run.extent.centre)) + 2 * run.extent.radius + 5;
  const [near, far] = camera.parallel ? [distance - beyond, distance + beyond] : [distance / 50, distance * 20 + 20];
  const f = distance / half;
  const lens = camera.parallel
    ? new Float32Array([1 / (half * aspect), 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, 2 / (near - far), 0, 0, 0, (far + near) / (near - far), 1])
    : new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
  const depth = (z) => camera.parallel ? near + z * (far - near) : (far * near) / (far - z * (far - near));
  return { eye, all: product(lens, view), half, aspect, depth };
}

// The point at (x, y) of the screen, -1 to 1, x to the right and y up, at a distance along the line of sight.
function pointAt(x, y, depth = camera.distance) {
  const { half, aspect } = projection(gl.canvas.clientWidth / gl.canvas.clientHeight), { back, right, up } = directions();
  const size = half * (camera.parallel ? 1 : depth / camera.distance);
  const middle = add(camera.target, times(back, camera.distance - depth));
  return add(middle, add(times(right, x * size * aspect), times(up, y * size)));
}

// Scales the view about a point, which keeps its place on the screen.
function zoom(factor, point) {
  const distance = Math.min(Math.max(camera.distance * factor, 0.01), 100 * run.extent.radius);
  camera.target = add(point, times(sub(camera.target, point), distance / camera.distance));
  camera.distance = distance;
}

function pan(dx, dy) {
  const { half } = projection(gl.canvas.clientWidth / gl.canvas.clientHeight), { right, up } = directions();
  const size = (2 * half) / gl.canvas.clientHeight;
  camera.target = add(camera.target, add(times(right, -dx * size), times(up, dy * size)));
}

function rotate(dx, dy) {
  camera.yaw -= dx * 0.008;
  camera.pitch = Math.min(Math.max(camera.pitch + dy * 0.008, -Math.PI / 2), Math.PI / 2);
}

// The camera keeps its place relative to what it follows.
function follow(now) {
  const axes = run.axes.find((axes) => axes.name === camera.follows), before = camera.followed;
  camera.followed = axes ? { axes, p: axisPose(axes, now).p } : null;
  if (!axes || !before || before.axes !== axes) return;
  const step = sub(camera.followed.p, before.p);
  for (const view of camera.glide ? [camera, camera.glide.from, camera.glide.to] : [camera]) view.target = add(view.target, step);
}

const axisPose = (axes, now) => {
  const frame = now[axes.frame];
  return axes.p ? { p: add(frame.p, turn(frame.q, axes.p)), q: mul(frame.q, axes.q) } : frame;
};

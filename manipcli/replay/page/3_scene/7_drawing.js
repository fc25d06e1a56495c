// Rendering of the scene at a time.

// Other runs, the plan, and the reference.
const GHOSTS = [[0.93, 0.42, 0.05, 0.42], [0.13, 0.6, 0.33, 0.42], [0.6, 0.2, 0.7, 0.42]];
const PLANNED = [0.04, 0.62, 0.45, 0.42];
const GHOST = [0.16, 0.45, 0.95, 0.38], PATH = [0.93, 0.42, 0.05], EDGES = [0.1, 0.14, 0.2, 1];
const INERTIA = [0.2, 0.45, 0.9, 0.4], MASS = [0.85, 0.1, 0.75, 1], NORMAL = [0.86, 0.1, 0.2, 1], FRICTION = [0.95, 0.6, 0.05, 1];
// Called at the end of each drawing with the matrix of the camera.
const overlays = [];

// Switch and colour of the k-th ghost.
const ghostLook = ({ kind }, k) => kind === "planned"
  ? { key: "planned", title: "as planned before the run; each step begins when it began in the run", colour: PLANNED }
  : { key: `run-${k}`, title: "another run", colour: GHOSTS[k % GHOSTS.length] };

// Whether there is a ghost at t: the plan has none during steps that were not planned.
const ghostAt = ({ visible }, t) => !visible || visible.some(([from, to]) => from <= t && t <= to);

function solid(mesh, model, colour, wire = false) {
  gl.uniform4fv(programs.solid.colour, colour);
  drawSurface(mesh, programs.solid, model, wire);
}

function pointer(pose, length, radius, colour) {
  const head = Math.min(4.5 * radius, 0.6 * length);
  solid(shapes.shaft, matrix(pose, [radius, radius, length - head]), colour);
  const tip = { p: add(pose.p, turn(pose.q, [0, 0, length - head])), q: pose.q };
  solid(shapes.head, matrix(tip, [2.4 * radius, 2.4 * radius, head]), colour);
}

// Drawables at other poses, all in one colour: only their nearest surface, and behind other surfaces at the same place.
function translucent(where, drawables, colour) {
  const models = where.map((pose) => matrix(pose));
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(2, 2);
  gl.depthMask(true);
  gl.colorMask(false, false, false, false);
  for (const drawable of drawables) solid(surfaces[drawable.surface], models[drawable.frame], colour);
  gl.colorMask(true, true, true, true);
  for (const drawable of drawables) solid(surfaces[drawable.surface], models[drawable.frame], colour);
  gl.disable(gl.POLYGON_OFFSET_FILL);
}

// Translucent surfaces [mesh, model, colour], the farthest first; of each, what looks away first.
function drawClear(clear, back) {
  const far = ([mesh, m]) => {
    const [x, y, z] = [0, 1, 2].map((c) => mesh.low[c] + mesh.size[c] * (mesh.low[c] ? 0.5 : 0));
    return dot(back, [0, 1, 2].map((c) => m[c] * x + m[4 + c] * y + m[8 + c] * z + m[12 + c]));
  };
  gl.depthMask(false);
  gl.enable(gl.CULL_FACE);
  // Before an opaque surface at the same place.
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.polygonOffset(-1, -1);
  for (const { item } of clear.map((item) => ({ item, at: far(item) })).sort((a, b) => a.at - b.at))
    for (const side of [gl.FRONT, gl.BACK]) {
      gl.cullFace(side);
      solid(...item);
    }
  gl.disable(gl.POLYGON_OFFSET_FILL);
  gl.disable(gl.CULL_FACE);
  gl.depthMask(true);
}

// Drawn behind surfaces too: faint there.
function through(what) {
  what(1);
  gl.depthFunc(gl.GREATER);
  gl.depthMask(false);
  what(0.25);
  gl.depthMask(true);
  gl.depthFunc(gl.LEQUAL);
}

// The forces at a time, at points that the parts have carried along: { p, normal, friction, pair }.
function pushesAt(now, t) {
  const k = moment(t, pushTimes)[0], found = [];
  for (let j = pushFirst[k]; j < pushFirst[k + 1]; j++) {
    const [x, y, z, ...forces] = pushes.subarray(9 * j, 9 * j + 9), { p } = now[run.pushes.frames[pushPair[j]]];
    found.push({ p: add(p, [x, y, z]), normal: forces.slice(0, 3), friction: forces.slice(3), pair: pushPair[j] });
  }
  return found;
}

// The arrow of a force [N] at a point: it begins there, or ends there if it pushes from outside.
function push(point, force, before, colour) {
  const size = Math.hypot(...force), length = Math.min(size * run.pushes.scale, run.pushes.longest) * sizes.force;
  if (length < 1e-3) return;
  const direction = unit(force);
  pointer(along(before ? sub(point, times(direction, length)) : point, direction), length, Math.min(0.004, length / 12), colour);
}

function drawGround(all) {
  const at = programs.ground;
  gl.useProgram(at.made);
  gl.uniformMatrix4fv(at.all, false, all);
  gl.uniform2f(at.middle, camera.target[0], camera.target[1]);
  shine(at);
  gl.depthMask(false);
  if (shows.grid) {
    gl.uniform4f(at.colour, 0.5, 0.54, 0.6, 0.55);
    gl.uniform1f(at.reach, 3);
    gl.uniform1f(at.dark, 0);
    gl.bindVertexArray(grid.vao);
    gl.drawArrays(gl.LINES, 0, grid.count);
  }
  if (shows.shadows) {
    gl.uniform4f(at.colour, 0.1, 0.13, 0.18, 0.3);
    gl.uniform1f(at.reach, 20);
    gl.uniform1f(at.dark, 1);
    gl.bindVertexArray(ground.vao);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
  gl.depthMask(true);
}

function drawPath(all, t, ratio, size) {
  const to = programs.lines, [now, way] = moment(t), piece = (first, last, width, alpha, from = path) => {
    if (last <= first) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, from.buffer);
    attribute(to, "a", 3, gl.FLOAT, false, 12, 12 * first, 1);
    attribute(to, "b", 3, gl.FLOAT, false, 12, 12 * first + 12, 1);
    gl.uniform1f(to.width, width * ratio);
    gl.uniform4f(to.colour, ...PATH, alpha);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, last - first);
  };
  gl.useProgram(to.made);
  gl.uniformMatrix4fv(to.all, false, all);
  gl.uniform2f(to.window, ...size);
  gl.bindVertexArray(path.vao);
  gl.depthMask(false);
  if (shows.path) piece(0, path.route.count, 1.2, 0.35, path.route);
  if (shows.trail) {
    piece(moment(Math.max(t - sizes.trail, run.start))[0], Math.min(now, path.count), 3, 1);
    if (way > 0) {
      const ends = [0, way].flatMap((fraction) => [0, 1, 2].map((c) => between(path.points, 3, c, now, fraction)));
      gl.bindBuffer(gl.ARRAY_BUFFER, path.buffer);
      gl.bufferSubData(gl.ARRAY_BUFFER, 12 * (path.count + 1), new Float32Array(ends));
      piece(path.count + 1, path.count + 2, 3, 1);
    }
  }
  gl.depthMask(true);
}

function draw(t) {
  if (camera.glide) glideOn();
  const canvas = gl.canvas, ratio = Math.min(window.devicePixelRatio || 1, 2);
  const wide = Math.max(Math.round(canvas.clientWidth * ratio), 1), high = Math.max(Math.round(canvas.clientHeight * ratio), 1);
  if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
  const now = poses(measured, t), models = now.map((pose) => matrix(pose));
  follow(now);
  const { eye, all, half, aspect } = projection(wide / high), { back } = directions();
  const opaque = shows.visual ? run.drawables.filter((drawable) => drawable.rgba[3] >= 1) : [], wire = shows.wire;
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  if (shows.shadows) castShadows(opaque, models, t, half, aspect);
  gl.viewport(0, 0, wide, high);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  drawGround(all);

  const at = programs.solid;
  gl.useProgram(at.made);
  gl.uniformMatrix4fv(at.all, false, all);
  gl.uniform3fv(at.towards, camera.parallel ? back : eye);
  gl.uniform1f(at.parallel, camera.parallel ? 1 : 0);
  gl.uniform1f(at.plain, wire ? 1 : 0);
  shine(at);
  for (const { surface, frame, rgba } of opaque) solid(surfaces[surface], models[frame], wire ? [...rgba.slice(0, 3).map((c) => 0.6 * c), 1] : rgba, wire);
  const clear = shows.visual ? run.drawables.filter((drawable) => drawable.rgba[3] < 1) : [], last = [];
  for (const { surface, frame, rgba } of clear) last.push([surfaces[surface], models[frame], rgba, wire]);
  if (shows.collision)
    for (const { surface, frame, rgba } of run.collision)
      if (wire) solid(surfaces[surface], models[frame], [...rgba.slice(0, 3), 1], true);
      else if (shows.visual) last.push([surfaces[surface], models[frame], rgba]);
      else solid(surfaces[surface], models[frame], [...rgba.slice(0, 3), 1]);
  if (shows.inertia)
    for (const each of run.inertias) last.push([shapes.cube, matrix(placedIn(each, now), each.box.map((edge) => Math.max(edge, 1e-3))), INERTIA]);
  gl.uniform1f(at.plain, 0);
  gl.uniform1f(at.shadows, 0);
  if (shows.frames) {
    const length = 0.045 * camera.distance * sizes.axes;
    through((strength) => {
      for (const axes of run.axes) {
        if (hiddenFrames.has(axes)) continue;
        const pose = axisPose(axes, now);
        for (let c = 0; c < 3; c++) {
          const direction = turn(pose.q, [c === 0 ? 1 : 0, c === 1 ? 1 : 0, c === 2 ? 1 : 0]);
          pointer(along(pose.p, direction), length, length / 26, [0.85 * (c === 0), 0.65 * (c === 1), 0.95 * (c === 2), strength]);
        }
      }
    });
  }
  if (shows.mass) {
    const radius = 0.007 * camera.distance, spot = (p, size, strength) =>
      solid(shapes.ball, matrix({ p, q: [0, 0, 0, 1] }, [size, size, size]), [...MASS.slice(0, 3), strength]);
    through((strength) => {
      for (const each of run.inertias) spot(placedIn(each, now).p, radius, strength < 1 ? 0.6 : 1);
      const whole = robotMass(now);
      if (whole) spot(whole.p, 1.8 * radius, strength < 1 ? 0.6 : 1);
    });
  }
  if (shows.forces && run.pushes) {
    for (const { p, normal, friction } of pushesAt(now, t)) {
      push(p, normal, 1, NORMAL);
      push(p, friction, 0, FRICTION);
    }
  }
  drawClear(last, back);
  if (shows.ghost && wanted) translucent(poses(wanted, t), run.drawables.filter((drawable) => drawable.robot), GHOST);
  const moving = (drawable) => drawable.robot || run.frames[drawable.frame].body !== undefined;
  for (const ghost of ghosts)
    if (shows[ghost.key] && ghostAt(ghost, t)) translucent(poses(ghost.position, t, ghost.body), run.drawables.filter(moving), ghost.colour);
  if (path && path.count > 0) drawPath(all, t, ratio, [wide, high]);
  gl.depthMask(true);
  for (const overlay of overlays) overlay(all);
  label(all, now, models, t);
}

// The pose of what has a pose in a frame.
const placedIn = (each, now) => ({ p: add(now[each.frame].p, turn(now[each.frame].q, each.p)), q: mul(now[each.frame].q, each.q) });

// Centre of mass and mass of all links; null without any.
function robotMass(now) {
  const links = run.inertias.filter((each) => each.robot), mass = links.reduce((sum, each) => sum + each.mass, 0);
  if (!mass) return null;
  return { mass, p: links.reduce((sum, each) => add(sum, times(placedIn(each, now).p, each.mass / mass)), [0, 0, 0]) };
}

// Rendering of the scene.

// Reference, and other runs.
const GHOSTS = [[0.93, 0.42, 0.05, 0.42], [0.13, 0.6, 0.33, 0.42], [0.6, 0.2, 0.7, 0.42]];
const GHOST = [0.16, 0.45, 0.95, 0.38], SUN = [0.45, 0.25, 0.86], PATH = [0.93, 0.42, 0.05];

function furnish(canvas) {
  gl = canvas.getContext("webgl2", { antialias: true, alpha: true, stencil: true });
  if (!gl) throw new Error("No WebGL 2 in this browser; the 3D view needs it.");
  programs = { solid: program(SOLID), lines: program(LINES), grid: program(GRID) };
  surfaces = run.surfaces.map((s) => surface(array(s.places), array(s.normals), array(s.faces), s.low, s.size));
  arrow = { shaft: rounds(1), head: rounds(0) };
  const lines = [], R = 4;
  for (let k = -10 * R; k <= 10 * R; k++) {
    const c = k / 10;
    lines.push(c, -R, run.ground, c, R, run.ground, -R, c, run.ground, R, c, run.ground);
  }
  grid = { vao: gl.createVertexArray(), count: lines.length / 3 };
  gl.bindVertexArray(grid.vao);
  buffer(new Float32Array(lines));
  attribute(programs.grid, "place", 3, gl.FLOAT, false, 12);
  if (run.path) {
    const points = array(run.path);
    path = { vao: gl.createVertexArray(), count: points.length / 3 - 1 };
    gl.bindVertexArray(path.vao);
    buffer(points);
    attribute(programs.lines, "a", 3, gl.FLOAT, false, 12, 0, 1);
    attribute(programs.lines, "b", 3, gl.FLOAT, false, 12, 12, 1);
  }
}

function solid(mesh, model, colour) {
  const at = programs.solid;
  gl.uniformMatrix4fv(at.model, false, model);
  gl.uniform4fv(at.colour, colour);
  gl.uniform3fv(at.low, mesh.low);
  gl.uniform3fv(at.size, mesh.size);
  gl.bindVertexArray(mesh.vao);
  gl.drawElements(gl.TRIANGLES, mesh.count, mesh.type, 0);
}

function pointer(pose, length, radius, colour) {
  const head = Math.min(4.5 * radius, 0.6 * length);
  solid(arrow.shaft, matrix(pose, [radius, radius, length - head]), colour);
  const tip = { p: add(pose.p, turn(pose.q, [0, 0, length - head])), q: pose.q };
  solid(arrow.head, matrix(tip, [2.4 * radius, 2.4 * radius, head]), colour);
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

// A force at a point: the arrow ends there (`before` 1) or begins there (0).
function push(point, force, before, colour) {
  const newtons = Math.hypot(...force), length = Math.min(newtons * run.pushes.scale, 2 * run.pushes.longest);
  if (length < 1e-4) return;
  const direction = times(force, 1 / newtons);
  pointer(along(sub(point, times(direction, before * length)), direction), length, 0.0035, colour);
}

function draw(t) {
  const canvas = gl.canvas, ratio = Math.min(window.devicePixelRatio || 1, 2);
  const wide = Math.round(canvas.clientWidth * ratio), high = Math.round(canvas.clientHeight * ratio);
  if (!wide || !high) return;
  if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
  const { eye, all } = projection(wide / high), now = poses(measured, t), models = now.map((pose) => matrix(pose));
  gl.viewport(0, 0, wide, high);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  gl.useProgram(programs.grid.made);
  gl.uniformMatrix4fv(programs.grid.all, false, all);
  gl.uniform4f(programs.grid.colour, 0.5, 0.54, 0.6, 0.55);
  gl.uniform2f(programs.grid.middle, camera.target[0], camera.target[1]);
  gl.uniform1f(programs.grid.reach, 3);
  gl.depthMask(false);
  gl.bindVertexArray(grid.vao);
  gl.drawArrays(gl.LINES, 0, grid.count);

  const at = programs.solid;
  gl.useProgram(at.made);
  gl.uniformMatrix4fv(at.all, false, all);
  gl.uniform3fv(at.eye, eye);
  const opaque = run.drawables.filter((drawable) => drawable.rgba[3] >= 1), clear = run.drawables.filter((drawable) => drawable.rgba[3] < 1);

  // Shadows: everything projected onto the ground along the light; the stencil prevents overlaps from darkening twice.
  gl.uniform1f(at.flat_, 1);
  gl.enable(gl.STENCIL_TEST);
  gl.stencilFunc(gl.EQUAL, 0, 255);
  gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
  const [sx, sy] = [SUN[0] / SUN[2], SUN[1] / SUN[2]], g = run.ground;
  const shadow = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, -sx, -sy, 0, 0, sx * g, sy * g, g, 1]);
  for (const drawable of opaque) solid(surfaces[drawable.surface], product(shadow, models[drawable.frame]), [0.1, 0.13, 0.18, 0.13]);
  gl.disable(gl.STENCIL_TEST);
  gl.uniform1f(at.flat_, 0);

  gl.depthMask(true);
  for (const drawable of opaque) solid(surfaces[drawable.surface], models[drawable.frame], drawable.rgba);
  if (shows.frames) {
    const length = 0.045 * camera.distance;
    for (const axes of run.axes) {
      const pose = axisPose(axes, now);
      for (let c = 0; c < 3; c++) {
        const direction = turn(pose.q, [c === 0 ? 1 : 0, c === 1 ? 1 : 0, c === 2 ? 1 : 0]);
        pointer(along(pose.p, direction), length, length / 26, [0.85 * (c === 0), 0.65 * (c === 1), 0.95 * (c === 2), 1]);
      }
    }
  }
  if (shows.forces && run.pushes) {
    const k = moment(t)[0];
    for (let j = pushFirst[k]; j < pushFirst[k + 1]; j++) {
      const [x, y, z, ...forces] = pushes.subarray(9 * j, 9 * j + 9);
      push([x, y, z], forces.slice(0, 3), 1, [0.86, 0.1, 0.2, 1]);
      push([x, y, z], forces.slice(3), 0, [0.95, 0.6, 0.05, 1]);
    }
  }
  gl.depthMask(false);
  for (const drawable of clear) solid(surfaces[drawable.surface], models[drawable.frame], drawable.rgba);
  if (shows.ghost && wanted) translucent(poses(wanted, t), run.drawables.filter((drawable) => drawable.robot), GHOST);
  const moving = (drawable) => drawable.robot || run.frames[drawable.frame].body !== undefined;
  ghosts.forEach((ghost, k) => {
    if (!shows[`run-${k}`]) return;
    translucent(poses(ghost.position, t, ghost.body), run.drawables.filter(moving), GHOSTS[k % GHOSTS.length]);
  });
  if (shows.path && path && path.count > 0) {
    const to = programs.lines;
    gl.useProgram(to.made);
    gl.uniformMatrix4fv(to.all, false, all);
    gl.uniform2f(to.window, wide, high);
    gl.bindVertexArray(path.vao);
    gl.uniform1f(to.width, 1.2 * ratio);
    gl.uniform4f(to.colour, ...PATH, 0.35);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, path.count);
    gl.uniform1f(to.width, 3 * ratio);
    gl.uniform4f(to.colour, ...PATH, 1);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, moment(t)[0]);
  }
  gl.depthMask(true);
  label(all, now);
}

const axisPose = (axes, now) => {
  const frame = now[axes.frame];
  return axes.p ? { p: add(frame.p, turn(frame.q, axes.p)), q: mul(frame.q, axes.q) } : frame;
};

function label(all, now) {
  const tags = part("tags");
  if (shows.frames && !tags.childElementCount) {
    for (const axes of run.axes) {
      const tag = tags.appendChild(document.createElement("div"));
      tag.className = "tag";
      tag.textContent = axes.name;
    }
  }
  tags.hidden = !shows.frames;
  if (!shows.frames) return;
  const { clientWidth: wide, clientHeight: high } = gl.canvas;
  run.axes.forEach((axes, k) => {
    const { p } = axisPose(axes, now), at = [0, 1, 2, 3].map((c) => all[c] * p[0] + all[4 + c] * p[1] + all[8 + c] * p[2] + all[12 + c]);
    const tag = tags.children[k];
    tag.style.display = at[3] > 0 ? "" : "none";
    tag.style.transform = `translate(${((at[0] / at[3]) * 0.5 + 0.5) * wide + 5}px, ${(0.5 - (at[1] / at[3]) * 0.5) * high + 3}px)`;
  });
}

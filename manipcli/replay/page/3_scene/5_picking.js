// What is at a place of the screen: the drawable that is nearest, and its distance.

let sight = null;

// Draws numbers of frames and depths into a picture of wide x high.
function see(wide, high, all, models, drawables) {
  if (!sight || sight.wide !== wide || sight.high !== high) {
    if (sight) for (const each of sight.buffers) gl.deleteRenderbuffer(each);
    sight = { wide, high, frame: sight ? sight.frame : gl.createFramebuffer(), buffers: [] };
    gl.bindFramebuffer(gl.FRAMEBUFFER, sight.frame);
    for (const [kind, place] of [[gl.RGBA8, gl.COLOR_ATTACHMENT0], [gl.RGBA8, gl.COLOR_ATTACHMENT1], [gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
      const made = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, made);
      gl.renderbufferStorage(gl.RENDERBUFFER, kind, wide, high);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, made);
      sight.buffers.push(made);
    }
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    [sight.what, sight.where] = [new Uint8Array(4 * wide * high), new Uint8Array(4 * wide * high)];
  }
  const at = programs.pick;
  gl.bindFramebuffer(gl.FRAMEBUFFER, sight.frame);
  gl.viewport(0, 0, wide, high);
  gl.disable(gl.BLEND);
  gl.depthMask(true);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.useProgram(at.made);
  gl.uniformMatrix4fv(at.all, false, all);
  for (const drawable of drawables) {
    gl.uniform1f(at.number, drawable.frame + 1);
    drawSurface(surfaces[drawable.surface], at, models[drawable.frame]);
  }
  [gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1].forEach((place, k) => {
    gl.readBuffer(place);
    gl.readPixels(0, 0, wide, high, gl.RGBA, gl.UNSIGNED_BYTE, [sight.what, sight.where][k]);
  });
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.enable(gl.BLEND);
}

// The frame and the depth (0 to 1) at a pixel of the last picture; null where nothing is.
function seenAt(x, y) {
  if (!(x >= 0 && y >= 0 && x < sight.wide && y < sight.high)) return null;
  const k = 4 * (Math.floor(y) * sight.wide + Math.floor(x)), whole = (from) => from[k] + 256 * from[k + 1] + 65536 * from[k + 2];
  return whole(sight.what) ? { frame: whole(sight.what) - 1, depth: whole(sight.where) / 16777215 } : null;
}

const visible = () => [...(shows.visual ? run.drawables : []), ...(shows.collision ? run.collision : [])];

// The frame and the point in the world at (x, y) of the screen, -1 to 1; null where nothing is.
function pick(x, y) {
  const wide = gl.canvas.clientWidth, high = gl.canvas.clientHeight, { all, depth } = projection(wide / high);
  // The picture is the one pixel at (x, y).
  const only = new Float32Array([wide, 0, 0, 0, 0, high, 0, 0, 0, 0, 1, 0, -x * wide, -y * high, 0, 1]);
  see(1, 1, product(only, all), poses(measured, time).map((pose) => matrix(pose)), visible());
  const seen = seenAt(0, 0);
  return seen && { frame: seen.frame, point: pointAt(x, y, depth(seen.depth)) };
}

// Shadows: depth as seen from the sun, of what is in view.

const TEXELS = 2048;
let shadow = null;

function furnishShadows() {
  const texture = gl.createTexture(), frame = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, TEXELS, TEXELS);
  for (const [name, value] of [["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"],
    ["WRAP_T", "CLAMP_TO_EDGE"], ["COMPARE_MODE", "COMPARE_REF_TO_TEXTURE"], ["COMPARE_FUNC", "LEQUAL"]])
    gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + name], gl[value]);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
  gl.drawBuffers([gl.NONE]);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  shadow = { texture, frame, matrix: null, texel: 0, key: "" };
}

// Draws what casts shadows as the sun sees it. The picture is around what the camera sees, at most around everything;
// its depth is that of everything, since what is out of view casts shadows too.
function castShadows(opaque, models, t, half, aspect) {
  const { centre, radius } = run.extent, seen = 2.5 * half * Math.max(1, aspect);
  const [middle, r] = seen < radius ? [camera.target, seen] : [centre, radius];
  const key = [t, ...middle, r, opaque.length].join();
  if (key === shadow.key) return;
  shadow.key = key;
  const back = unit(SUN), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
  const deep = 1.2 * radius, [x, y, z] = [dot(right, middle), dot(up, middle), dot(back, centre)];
  shadow.matrix = new Float32Array([
    right[0] / r, up[0] / r, -back[0] / deep, 0, right[1] / r, up[1] / r, -back[1] / deep, 0,
    right[2] / r, up[2] / r, -back[2] / deep, 0, -x / r, -y / r, z / deep, 1,
  ]);
  shadow.texel = (2 * r) / TEXELS;
  const at = programs.depth;
  gl.bindFramebuffer(gl.FRAMEBUFFER, shadow.frame);
  gl.viewport(0, 0, TEXELS, TEXELS);
  gl.depthMask(true);
  gl.clear(gl.DEPTH_BUFFER_BIT);
  gl.useProgram(at.made);
  gl.uniformMatrix4fv(at.all, false, shadow.matrix);
  for (const drawable of opaque) drawSurface(surfaces[drawable.surface], at, models[drawable.frame]);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
}

// For a program that has LIT.
function shine(at) {
  gl.uniform1f(at.shadows, shows.shadows ? 1 : 0);
  gl.uniform1i(at.shade, 0);
  gl.bindTexture(gl.TEXTURE_2D, shadow.texture);
  if (!shadow.matrix) return;
  gl.uniformMatrix4fv(at.sunward, false, shadow.matrix);
  gl.uniform1f(at.texel, shadow.texel);
}

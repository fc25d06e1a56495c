// Programs, buffers and surfaces on the graphics card.

let gl = null, programs = {}, surfaces = [], arrow = {}, path = null, grid = null;

function program([vertex, fragment]) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const at = { made };
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const { name } = gl.getActiveUniform(made, k);
    at[name] = gl.getUniformLocation(made, name);
  }
  return at;
}

function buffer(data, target = gl.ARRAY_BUFFER) {
  const made = gl.createBuffer();
  gl.bindBuffer(target, made);
  gl.bufferData(target, data, gl.STATIC_DRAW);
  return made;
}

function attribute(of, name, size, type, normalised, stride, offset = 0, divisor = 0) {
  const where = gl.getAttribLocation(of.made, name);
  gl.enableVertexAttribArray(where);
  gl.vertexAttribPointer(where, size, type, normalised, stride, offset);
  gl.vertexAttribDivisor(where, divisor);
}

function surface(places, normals, faces, low, size) {
  const vao = gl.createVertexArray(), small = places instanceof Uint16Array;
  gl.bindVertexArray(vao);
  buffer(places);
  attribute(programs.solid, "place", 3, small ? gl.UNSIGNED_SHORT : gl.FLOAT, small, small ? 8 : 12);
  buffer(normals);
  attribute(programs.solid, "normal", 3, gl.BYTE, true, 4);
  buffer(faces, gl.ELEMENT_ARRAY_BUFFER);
  const type = faces instanceof Uint16Array ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
  return { vao, count: faces.length, type, low, size };
}

// A shaft and a head along z, each of length and radius 1.
function rounds(top) {
  const places = [], normals = [], faces = [], N = 20;
  for (let k = 0; k <= N; k++) {
    const a = (2 * Math.PI * k) / N, x = Math.cos(a), y = Math.sin(a), z = top > 0 ? 0 : 0.5;
    places.push(x, y, 0, x * top, y * top, 1);
    for (let end = 0; end < 2; end++) normals.push(127 * x, 127 * y, 127 * z, 0);
    if (k < N) faces.push(2 * k, 2 * k + 2, 2 * k + 1, 2 * k + 1, 2 * k + 2, 2 * k + 3);
  }
  const low = places.length / 3;
  places.push(0, 0, 0);
  normals.push(0, 0, -127, 0);
  for (let k = 0; k < N; k++) faces.push(low, 2 * k + 2, 2 * k);
  return surface(new Float32Array(places), new Int8Array(normals), new Uint16Array(faces), [0, 0, 0], [1, 1, 1]);
}

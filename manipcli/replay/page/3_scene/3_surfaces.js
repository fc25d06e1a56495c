// Programs, buffers and surfaces on the graphics card.

let gl = null, programs = {}, surfaces = [], shapes = {}, path = null, grid = null, ground = null;

function program([vertex, fragment]) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.bindAttribLocation(made, 0, "place");
  gl.bindAttribLocation(made, 1, "normal");
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

// All programs have `place` at 0 and `normal` at 1, so that one surface serves all of them.
function surface(places, normals, faces, low = [0, 0, 0], size = [1, 1, 1]) {
  const vao = gl.createVertexArray(), small = places instanceof Uint16Array;
  gl.bindVertexArray(vao);
  buffer(places);
  attribute(programs.solid, "place", 3, small ? gl.UNSIGNED_SHORT : gl.FLOAT, small, small ? 8 : 12);
  buffer(normals);
  attribute(programs.solid, "normal", 3, gl.BYTE, true, 4);
  const triangles = buffer(faces, gl.ELEMENT_ARRAY_BUFFER);
  const type = faces instanceof Uint16Array ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
  return { vao, faces, count: faces.length, type, low, size, edges: null, triangles };
}

// Draws a surface with the program in use, as its triangles or their edges.
function drawSurface(mesh, at, model, wire = false) {
  gl.uniformMatrix4fv(at.model, false, model);
  gl.uniform3fv(at.low, mesh.low);
  gl.uniform3fv(at.size, mesh.size);
  gl.bindVertexArray(mesh.vao);
  if (!wire) return gl.drawElements(gl.TRIANGLES, mesh.count, mesh.type, 0);
  if (!mesh.edges) {
    const ends = new mesh.faces.constructor(2 * mesh.count);
    for (let k = 0; k < mesh.count; k++) {
      ends[2 * k] = mesh.faces[k];
      ends[2 * k + 1] = mesh.faces[k % 3 === 2 ? k - 2 : k + 1];
    }
    mesh.edges = buffer(ends, gl.ELEMENT_ARRAY_BUFFER);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.edges);
  gl.drawElements(gl.LINES, 2 * mesh.count, mesh.type, 0);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
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
  return surface(new Float32Array(places), new Int8Array(normals), new Uint16Array(faces));
}

// A cube with edges of 1 about the origin.
function cube() {
  const places = [], normals = [], faces = [];
  for (let c = 0; c < 3; c++)
    for (const side of [-1, 1]) {
      const low = places.length / 3;
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const place = [0, 0, 0], normal = [0, 0, 0, 0];
        [place[c], place[(c + 1) % 3], place[(c + 2) % 3], normal[c]] = [side / 2, a / 2, b / 2, 127 * side];
        places.push(...place);
        normals.push(...normal);
      }
      faces.push(...(side > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2]).map((k) => low + k));
    }
  return surface(new Float32Array(places), new Int8Array(normals), new Uint16Array(faces));
}

// A ball of radius 1.
function ball() {
  const places = [], normals = [], faces = [], N = 16;
  for (let i = 0; i <= N / 2; i++)
    for (let k = 0; k <= N; k++) {
      const polar = (2 * Math.PI * i) / N, a = (2 * Math.PI * k) / N;
      const place = [Math.sin(polar) * Math.cos(a), Math.sin(polar) * Math.sin(a), Math.cos(polar)], at = i * (N + 1) + k;
      places.push(...place);
      normals.push(...place.map((c) => 127 * c), 0);
      if (i < N / 2 && k < N) faces.push(at, at + N + 1, at + 1, at + 1, at + N + 1, at + N + 2);
    }
  return surface(new Float32Array(places), new Int8Array(normals), new Uint16Array(faces));
}

// Everything on the graphics card.
function furnish(canvas) {
  gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
  if (!gl) throw new Error("No WebGL 2 in this browser; the 3D view needs it.");
  programs = { solid: program(SOLID), lines: program(LINES), ground: program(GROUND), depth: program(DEPTH), pick: program(PICK) };
  surfaces = run.surfaces.map((s) => surface(array(s.places), array(s.normals), array(s.faces), s.low, s.size));
  shapes = { shaft: rounds(1), head: rounds(0), cube: cube(), ball: ball() };
  const lines = [], R = 4, z = run.ground;
  for (let k = -10 * R; k <= 10 * R; k++) lines.push(k / 10, -R, z, k / 10, R, z, -R, k / 10, z, R, k / 10, z);
  const flat = (points) => {
    const made = { vao: gl.createVertexArray(), count: points.length / 3 };
    gl.bindVertexArray(made.vao);
    buffer(new Float32Array(points));
    attribute(programs.ground, "place", 3, gl.FLOAT, false, 12);
    return made;
  };
  // As far as shadows reach.
  const [x, y] = run.extent.centre, r = 2 * run.extent.radius;
  [grid, ground] = [flat(lines), flat([x - r, y - r, z, x + r, y - r, z, x - r, y + r, z, x + r, y + r, z])];
  if (run.path) {
    const points = array(run.path), route = array(run.route);
    // Behind its points there is room for the line to the tool.
    path = { vao: gl.createVertexArray(), count: points.length / 3 - 1, points, route: { count: route.length / 3 - 1, buffer: buffer(route) }, buffer: buffer(new Float32Array([...points, 0, 0, 0, 0, 0, 0])) };
  }
  furnishShadows();
}

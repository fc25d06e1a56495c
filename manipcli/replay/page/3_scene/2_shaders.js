// The programs of the graphics card.

// Direction to the sun: from the right of the first view, so that shadows fall beside what casts them.
const SUN = [-0.25, 0.47, 0.85];
const PLACED = `#version 300 es
in vec3 place; in vec3 normal;
uniform mat4 all, model; uniform vec3 low, size;
`;
const LIT = `
uniform mat4 sunward; uniform highp sampler2DShadow shade; uniform float texel, shadows;
// Share of the sun's light at a point: means of 2 x 2 texels, at four places.
float sunlit(vec3 at, vec3 n) {
  if (shadows < 0.5) return 1.0;
  vec3 p = (sunward * vec4(at + 1.5 * texel * n, 1.0)).xyz * 0.5 + 0.5;
  if (any(greaterThan(abs(p - 0.5), vec3(0.499)))) return 1.0;
  vec2 one = 1.0 / vec2(textureSize(shade, 0));
  float sum = 0.0;
  for (int k = 0; k < 4; k++) sum += texture(shade, vec3(p.xy + one * (vec2(k % 2, k / 2) - 0.5) * 1.6, p.z - 0.0006));
  return 0.25 * sum;
}`;
const SOLID = [`${PLACED}
out vec3 n, at;
void main() {
  vec4 world = model * vec4(low + size * place, 1.0);
  n = mat3(model) * normal; at = world.xyz;
  gl_Position = all * world;
}`, `#version 300 es
precision highp float;
in vec3 n, at; uniform vec4 colour; uniform vec3 towards; uniform float parallel, plain;
out vec4 shown;
${LIT}
void main() {
  if (plain > 0.5) { shown = vec4(colour.rgb * colour.a, colour.a); return; }
  vec3 m = normalize(gl_FrontFacing ? n : -n), to = parallel > 0.5 ? towards : normalize(towards - at), sun = normalize(vec3(${SUN}));
  float sky = 0.5 + 0.5 * m.z, facing = max(dot(m, sun), 0.0), lit = facing > 0.0 ? sunlit(at, m) : 0.0;
  vec3 light = mix(vec3(0.36, 0.35, 0.37), vec3(0.54, 0.56, 0.60), sky) + 0.52 * lit * facing + 0.14 * max(dot(m, to), 0.0);
  float shine = 0.16 * lit * pow(max(dot(m, normalize(sun + to)), 0.0), 36.0);
  vec3 seen = min(colour.rgb * light + shine, vec3(1.0));
  shown = vec4(seen * colour.a, colour.a);
}`];
// Only depth, for shadows.
const DEPTH = [`${PLACED}
void main() { gl_Position = all * model * vec4(low + size * place, 1.0); }`, `#version 300 es
precision highp float;
void main() {}`];
// Number of the frame, and depth, in 24 bits each.
const PICK = [DEPTH[0], `#version 300 es
precision highp float;
uniform float number; layout(location = 0) out vec4 what; layout(location = 1) out vec4 where;
vec4 bytes(float whole) {
  return vec4(mod(whole, 256.0), mod(floor(whole / 256.0), 256.0), floor(whole / 65536.0), 255.0) / 255.0;
}
void main() { what = bytes(number); where = bytes(floor(gl_FragCoord.z * 16777215.0)); }`];
// Lines of a width, one instance for each.
const LINES = [`#version 300 es
in vec3 a, b; uniform mat4 all; uniform vec2 window; uniform float width;
void main() {
  vec4 first = all * vec4(a, 1.0), second = all * vec4(b, 1.0);
  vec2 along = (second.xy / second.w - first.xy / first.w) * window;
  vec2 side = length(along) > 1e-6 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
  vec4 here = gl_VertexID < 2 ? first : second;
  here.xy += side * (gl_VertexID % 2 == 0 ? 1.0 : -1.0) * width / window * here.w;
  gl_Position = here;
}`, `#version 300 es
precision highp float;
uniform vec4 colour; out vec4 shown;
void main() { shown = vec4(colour.rgb * colour.a, colour.a); }`];
// The ground around the target: a grid, or what is in the shadow.
const GROUND = [`#version 300 es
in vec3 place; uniform mat4 all; out vec3 at;
void main() { at = place; gl_Position = all * vec4(place, 1.0); }`, `#version 300 es
precision highp float;
in vec3 at; uniform vec4 colour; uniform vec2 middle; uniform float reach, dark; out vec4 shown;
${LIT}
void main() {
  float a = colour.a * clamp(1.0 - length(at.xy - middle) / reach, 0.0, 1.0);
  if (dark > 0.5) a *= 1.0 - sunlit(at, vec3(0.0, 0.0, 1.0));
  shown = vec4(colour.rgb * a, a);
}`];

// The programs of the graphics card.

const SOLID = [`#version 300 es
in vec3 place; in vec3 normal;
uniform mat4 all, model; uniform vec3 low, size;
out vec3 n, at;
void main() {
  vec4 world = model * vec4(low + size * place, 1.0);
  n = mat3(model) * normal; at = world.xyz;
  gl_Position = all * world;
}`, `#version 300 es
precision highp float;
in vec3 n, at; uniform vec4 colour; uniform vec3 eye; uniform float flat_;
out vec4 shown;
void main() {
  if (flat_ > 0.5) { shown = vec4(colour.rgb * colour.a, colour.a); return; }
  vec3 m = normalize(gl_FrontFacing ? n : -n), to = normalize(eye - at), sun = normalize(vec3(0.45, 0.25, 0.86));
  float sky = 0.5 + 0.5 * m.z;
  vec3 light = mix(vec3(0.44, 0.43, 0.44), vec3(0.68, 0.70, 0.73), sky) + 0.36 * max(dot(m, sun), 0.0)
    + 0.10 * max(dot(m, to), 0.0);
  float shine = 0.16 * pow(max(dot(m, normalize(sun + to)), 0.0), 36.0);
  vec3 seen = min(colour.rgb * light + shine, vec3(1.0));
  shown = vec4(seen * colour.a, colour.a);
}`];
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
const GRID = [`#version 300 es
in vec3 place; uniform mat4 all; out vec2 at;
void main() { at = place.xy; gl_Position = all * vec4(place, 1.0); }`, `#version 300 es
precision highp float;
in vec2 at; uniform vec4 colour; uniform vec2 middle; uniform float reach; out vec4 shown;
void main() {
  float a = colour.a * clamp(1.0 - length(at - middle) / reach, 0.0, 1.0);
  shown = vec4(colour.rgb * a, a);
}`];

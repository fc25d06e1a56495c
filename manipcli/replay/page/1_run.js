// Plays one run: draws triangles with WebGL, moves them by the joints and poses of the run, and draws its curves.
// Everything comes from the page: a JSON head, and arrays packed behind it. Units are SI, quaternions x y z w.
// The files of this folder are concatenated in the order of their names, inside one function.
"use strict";
const root = document.currentScript.closest(".mc-player");
const part = (name) => root.querySelector("[data-part=" + name + "]");
const run = JSON.parse(part("head").textContent);

const KINDS = { f: Float32Array, H: Uint16Array, I: Uint32Array, b: Int8Array };
let packed = null;
const array = ([kind, offset, count]) => new KINDS[kind](packed, offset, count);

async function unpack() {
  const bytes = Uint8Array.from(atob(part("data").textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  packed = await new Response(stream).arrayBuffer();
}

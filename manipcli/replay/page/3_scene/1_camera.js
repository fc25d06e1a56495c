// The camera and its mouse and touch control.

const camera = { target: [...run.camera.target], distance: 1, yaw: 0, pitch: 0 };

function look() {
  const back = sub(run.camera.eye, run.camera.target);
  camera.target = [...run.camera.target];
  camera.distance = Math.hypot(...back);
  camera.yaw = Math.atan2(back[1], back[0]);
  camera.pitch = Math.asin(back[2] / camera.distance);
}

const backward = () => [
  Math.cos(camera.pitch) * Math.cos(camera.yaw), Math.cos(camera.pitch) * Math.sin(camera.yaw), Math.sin(camera.pitch),
];

function projection(aspect) {
  const back = backward(), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
  const eye = add(camera.target, times(back, camera.distance));
  const view = new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
  // The field of view is that of the shorter side, so that a narrow window shows everything.
  const near = camera.distance / 50, far = camera.distance * 20 + 20;
  const f = (1 / Math.tan((run.camera.field * Math.PI) / 360)) * Math.min(1, aspect);
  const lens = new Float32Array([
    f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0,
  ]);
  return { eye, all: product(lens, view) };
}

function steer(canvas) {
  const held = new Map();
  let spread = 0;
  const pan = (dx, dy) => {
    const back = backward(), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    const size = (2 * camera.distance * Math.tan((run.camera.field * Math.PI) / 360)) / canvas.clientHeight;
    camera.target = add(camera.target, add(times(right, -dx * size), times(up, dy * size)));
  };
  const apart = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button !== 0 || event.shiftKey });
    if (held.size === 2) spread = apart();
  });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = held.get(event.pointerId);
    if (!pointer) return;
    const dx = event.clientX - pointer.x, dy = event.clientY - pointer.y;
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    if (held.size === 2) {
      pan(dx / 2, dy / 2);
      camera.distance *= spread / apart();
      spread = apart();
    } else if (pointer.pans) {
      pan(dx, dy);
    } else {
      camera.yaw -= dx * 0.008;
      camera.pitch = Math.min(Math.max(camera.pitch + dy * 0.008, -1.5), 1.55);
    }
    refresh();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => held.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => { look(); refresh(); });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.distance *= Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 100) * 0.0015);
    refresh();
  }, { passive: false });
}

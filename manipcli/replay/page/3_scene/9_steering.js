// Mouse and touch on the 3D view, and its buttons. Left or one finger rotates; right, middle, Shift or two fingers pan.

function steer(canvas) {
  const held = new Map();
  const place = ({ clientX, clientY }) => {
    const box = canvas.getBoundingClientRect();
    return [(2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height];
  };
  // Zooming goes to what is below the pointer, without it to the plane of the target; looked up once per gesture.
  let aim = null;
  const zoomAt = (event, factor) => {
    const now = performance.now();
    if (!aim || now - aim.at > 400 || Math.hypot(event.clientX - aim.x, event.clientY - aim.y) > 3) {
      const at = place(event), seen = pick(...at);
      aim = { x: event.clientX, y: event.clientY, point: camera.follows ? camera.target : seen ? seen.point : pointAt(...at) };
    }
    aim.at = now;
    camera.glide = null;
    zoom(factor, aim.point);
  };
  const both = () => {
    const [a, b] = [...held.values()];
    return { clientX: (a.x + b.x) / 2, clientY: (a.y + b.y) / 2, apart: Math.max(Math.hypot(a.x - b.x, a.y - b.y), 1) };
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button !== 0 || event.shiftKey || steer.pans });
    camera.glide = aim = null;
    part("hint").classList.add("gone");
  });
  // No scrolling by the middle button.
  canvas.addEventListener("mousedown", (event) => { if (event.button === 1) event.preventDefault(); });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = held.get(event.pointerId);
    if (!pointer) return;
    const before = held.size === 2 ? both() : null, dx = event.clientX - pointer.x, dy = event.clientY - pointer.y;
    [pointer.x, pointer.y] = [event.clientX, event.clientY];
    if (before) {
      const after = both();
      pan(after.clientX - before.clientX, after.clientY - before.clientY);
      aim = null;
      zoomAt(after, before.apart / after.apart);
    } else if (pointer.pans) pan(dx, dy);
    else rotate(dx, dy);
    refresh();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => held.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", (event) => {
    const seen = pick(...place(event));
    if (!seen) return glideTo(firstView());
    const eye = add(camera.target, times(directions().back, camera.distance)), near = 0.7 * Math.hypot(...sub(eye, seen.point));
    glideTo({ target: seen.point, distance: Math.min(near, Math.max(0.25, 3.5 * sizeOf(seen.frame))) });
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    part("hint").classList.add("gone");
    const lines = event.deltaMode === 1 ? 30 : 1;
    zoomAt(event, Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY) * lines, 100) * 0.0015));
    refresh();
  }, { passive: false });
  buildViews();
}

// Half of the diagonal of what is drawn in a frame [m].
const sizeOf = (frame) => Math.max(0.05, ...run.drawables.filter((each) => each.frame === frame).map((each) => Math.hypot(...surfaces[each.surface].size) / 2));

function buildViews() {
  const bar = element(root.querySelector(".view"), "div", "views"), hint = element(root.querySelector(".view"), "div", "hint");
  const button = (text, title, press) => {
    const made = element(bar, "button", "", text);
    [made.type, made.title] = ["button", title];
    if (!/\w/.test(text)) made.setAttribute("aria-label", title);
    made.addEventListener("click", () => { press(made); refresh(); });
    return made;
  };
  const toggle = (text, title, set) => {
    const made = button(text, title, () => { made.setAttribute("aria-pressed", made.getAttribute("aria-pressed") !== "true"); set(made.getAttribute("aria-pressed") === "true"); });
    made.setAttribute("aria-pressed", false);
  };
  button("⌂", "first view", () => { follower.value = camera.follows = ""; glideTo(firstView()); });
  for (const [name, view] of Object.entries(VIEWS)) button(name, `view from ${name === "top" ? "above" : `the ${name}`}`, () => glideTo(view));
  toggle("parallel", "parallel projection, without perspective", (on) => { camera.parallel = on; });
  toggle("pan", "dragging moves the view instead of rotating it", (on) => { steer.pans = on; gl.canvas.classList.toggle("pans", on); });
  const follower = element(bar, "select");
  follower.setAttribute("aria-label", "body that the camera follows");
  follower.title = "the camera moves with it";
  element(follower, "option", "", "follow –").value = "";
  const moving = run.axes.filter((axes) => axes.p ? axes.name === "tool" : run.frames[axes.frame].body !== undefined);
  for (const { name } of moving.sort((a, b) => (b.name === "tool") - (a.name === "tool"))) element(follower, "option", "", `follow ${name}`).value = name;
  follower.hidden = !moving.length;
  follower.addEventListener("change", () => {
    camera.follows = follower.value;
    const axes = run.axes.find((axes) => axes.name === camera.follows);
    if (axes) glideTo({ target: axisPose(axes, poses(measured, time)).p });
  });
  hint.dataset.part = "hint";
  hint.textContent = matchMedia("(pointer: coarse)").matches
    ? "one finger rotates · two fingers move and zoom · double tap: focus"
    : "drag: rotate · right or middle drag: move · wheel: zoom to the pointer · double click: focus";
  setTimeout(() => hint.classList.add("gone"), 8000);
}

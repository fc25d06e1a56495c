// The shown time and playback.

let stamps, measured, wanted, bodies, pushTimes, pushFirst, pushes, pushPair, ghosts = [];
let time = run.start, playing = false, before = 0, waiting = false;

function stepAt(t) {
  for (let k = run.steps.length - 1; k >= 0; k--)
    if (run.steps[k].start <= t + 1e-9 && t <= run.steps[k].end) return run.steps[k];
  return null;
}

function refresh() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame((now) => {
    waiting = false;
    if (playing) {
      time += ((now - before) / 1000) * Number(part("speed").value);
      before = now;
      if (time >= run.end) {
        if (part("loop").checked) time = run.start;
        else { time = run.end; play(false); }
      }
    }
    if (gl) draw(time);
    drawPlot();
    showStatus();
    if (playing) refresh();
  });
}

function play(on) {
  if (on && time >= run.end) time = run.start;
  playing = on;
  before = performance.now();
  part("play").textContent = on ? "❚❚" : "▶";
  part("play").setAttribute("aria-label", on ? "pause" : "play");
  refresh();
}

function seek(t) {
  time = Math.min(Math.max(t, run.start), run.end);
  refresh();
}

function showStatus() {
  const step = stepAt(time), phase = step && [...step.phases].reverse().find((phase) => phase.start <= time + 1e-9);
  part("now").textContent = step ? step.label : run.name;
  const gap = gapAt(time);
  part("phase").textContent = gap ? `no data until ${gap[1].toFixed(2)} s` : phase ? phase.name : "";
  part("clock").textContent = `${time.toFixed(2)} / ${run.end.toFixed(2)} s`;
  const track = part("track");
  part("head-line").style.left = `${(100 * (time - run.start)) / (run.end - run.start || 1)}%`;
  track.setAttribute("aria-valuenow", time.toFixed(2));
  track.setAttribute("aria-valuetext", `${time.toFixed(2)} s${step ? ", " + step.label : ""}`);
  if (step === showStatus.step) return;
  showStatus.step = step;
  for (const mark of root.querySelectorAll("[data-step]"))
    mark.classList.toggle("now", step !== null && run.steps[Number(mark.dataset.step)] === step);
  const button = step && part("steps").querySelector(`[data-step="${run.steps.indexOf(step)}"]`);
  if (button) {
    const box = part("steps");
    if (button.offsetTop < box.scrollTop + box.offsetTop || button.offsetTop + button.offsetHeight > box.scrollTop + box.offsetTop + box.clientHeight)
      box.scrollTop = button.offsetTop - box.offsetTop - 4;
  }
}

// Where the page opens: at the time of its address, else at the failure, else at the start; and the causes.

// A time in the address, `#t=12.3` or `?t=12.3` [s]; null without one.
function addressed() {
  for (const text of [location.hash, location.search]) {
    const t = parseFloat(new URLSearchParams(text.slice(1)).get("t"));
    if (Number.isFinite(t)) return t;
  }
  return null;
}

const failures = run.causes.filter((cause) => cause.at !== null);

// Just before its end, a failed step is the one that is marked.
function showFailure(cause) {
  seek(cause.at - 1e-6);
  if (cause.expectation) choose("margins", cause.expectation);
}

function showNextFailure() {
  showNextFailure.last = failures.length ? ((showNextFailure.last ?? -1) + 1) % failures.length : 0;
  if (failures.length) showFailure(failures[showNextFailure.last]);
}

function open() {
  const t = addressed();
  if (t === null && failures.length) showNextFailure();
  else seek(t ?? run.start);
  addEventListener("hashchange", () => { const t = addressed(); if (t !== null) seek(t); });
}

function causeEntry(box, cause) {
  const made = element(box, "div", "reason");
  element(made, "b", "", `✗ ${cause.title}`);
  if (cause.text) element(made, "p", "", cause.text);
  if (cause.hint) element(made, "p", "hint", `hint: ${cause.hint}`);
  const line = element(made, "p", "where");
  if (cause.at !== null) {
    const button = element(line, "button", "", `▸ ${cause.at.toFixed(2)} s`);
    button.type = "button";
    button.title = cause.expectation ? "show this moment and the margin" : "show this moment";
    button.addEventListener("click", () => { play(false); showFailure(cause); });
  }
  if (cause.place) element(line, "span", "", cause.place);
}

function buildCauses() {
  const box = part("causes"), [first, ...others] = run.causes;
  box.hidden = !first;
  if (!first) return;
  causeEntry(box, first);
  if (!others.length) return;
  const more = element(box, "details");
  element(more, "summary", "", `${others.length} more`);
  for (const cause of others) causeEntry(more, cause);
}

// The switch between light and dark; the browser keeps the choice where it allows that.
(function () {
  "use strict";
  const root = document.documentElement, KEY = "manipcli.scheme", dark = matchMedia("(prefers-color-scheme: dark)");
  const show = (scheme) => {
    root.dataset.scheme = scheme;
    const other = scheme === "dark" ? "light" : "dark", button = document.querySelector(".scheme");
    button.title = `${other} colours`;
    button.setAttribute("aria-label", `${other} colours`);
    root.dispatchEvent(new Event("scheme"));
  };
  let kept = null;
  try { kept = localStorage.getItem(KEY); } catch { /* a page without storage */ }
  const chosen = () => (kept === "dark" || kept === "light" ? kept : dark.matches ? "dark" : "light");
  document.querySelector(".scheme").addEventListener("click", () => {
    kept = root.dataset.scheme === "dark" ? "light" : "dark";
    try { localStorage.setItem(KEY, kept); } catch { /* a page without storage */ }
    show(kept);
  });
  dark.addEventListener("change", () => show(chosen()));
  show(chosen());
})();

// Tells the app where the pointer is: over the 3D scene, in thousandths of its width and height, or over an
// element that stands for a module, data-m; and what in the scene is clicked.
window.taPointing ||= (() => {
  const STEP = 120; // milliseconds between two reports
  const STILL = 5; // pixels that a click may move: more is a turn of the camera
  let point = () => {}, pick = () => {}, said = "none", next = "none", waits = false, from = null;
  const onScene = (e) => e.target.matches?.("canvas[data-engine]");
  const place = (e) => {
    const box = e.target.getBoundingClientRect();
    const parts = [(e.clientX - box.left) / box.width, (e.clientY - box.top) / box.height];
    return `at:${parts.map((p) => Math.round(999 * Math.min(Math.max(p, 0), 1))).join()}`;
  };
  const say = (what) => {
    next = what;
    if (waits || next === said) return;
    waits = true;
    point((said = next));
    setTimeout(() => { waits = false; say(next); }, STEP);
  };
  const on = (kind, act) => document.addEventListener(kind, act, { capture: true, passive: true });
  on("pointermove", (e) => { if (onScene(e) && !e.buttons && e.pointerType !== "touch") say(place(e)); });
  on("pointerover", (e) => {
    const module = e.target.closest?.("[data-m]");
    if (module) say(`module:${module.dataset.m}`);
    else if (!onScene(e)) say("none");
  });
  on("pointerdown", (e) => { from = onScene(e) && e.button === 0 ? [e.clientX, e.clientY] : null; });
  on("pointerup", (e) => {
    if (from && onScene(e) && Math.hypot(e.clientX - from[0], e.clientY - from[1]) < STILL) pick(place(e));
    from = null;
  });
  // "window.": this runs in a handler of an element, whose own listeners would be meant
  window.addEventListener("keydown", (e) => { if (e.key === "Escape") pick("none"); });
  return { report: (pointed, picked) => { point = pointed; pick = picked; } };
})();

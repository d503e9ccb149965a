// What lies over the 3D scene. window.taOver is what the app calls; `send` reports what the user does there.
window.taOver ||= (() => {
  const VIEWS = [
    ["frame", "F", "Frame", "The robot and its target"],
    ["top", "T", "Top", "From above"],
    ["side", "B", "Side", "From beside"],
    ["head", "H", "Head", "Before its head"],
  ];
  const NOTICE = "Software WebGL rendering detected";
  let send = () => {};
  const make = (tag, name, parent) => {
    const element = document.createElement(tag);
    element.className = name;
    parent.appendChild(element);
    return element;
  };
  const over = document.createElement("div");
  over.className = "ta-over";
  const still = make("div", "ta-still", over);
  const line = make("div", "ta-line", over);
  const chip = make("div", "ta-chip", over);
  chip.hidden = true;
  const views = make("div", "ta-views", over);
  for (const [view, key, label, hint] of VIEWS) {
    const button = make("button", "", views);
    button.type = "button";
    button.textContent = label;
    button.title = `${hint} (${key})`;
    button.dataset.view = view;
    button.onclick = () => send(view);
  }
  // over the canvas; viser may make another one
  const settle = () => {
    const canvas = document.querySelector("canvas[data-engine]");
    const place = canvas?.parentElement?.parentElement;
    if (!place) return setTimeout(settle, 50);
    if (over.parentElement !== place) place.appendChild(over);
    setTimeout(settle, 1000);
  };
  settle();

  const isField = (e) => e?.closest?.("input,textarea,select,[contenteditable=true]");
  // "window.": this runs in a handler of an element, whose own listeners would be meant
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || isField(event.target)) return;
    const found = VIEWS.find(([, key]) => key === event.key.toUpperCase());
    if (found) send(found[0]);
  });
  // viser's own way back knows nothing of robots
  document.addEventListener("click", (event) => {
    const button = event.target.closest?.("button");
    if (button?.textContent.trim() !== "Reset View") return;
    event.stopPropagation();
    event.preventDefault();
    send("frame");
  }, true);
  for (const kind of ["pointerdown", "wheel"])
    document.addEventListener(kind, (event) => {
      if (event.target.matches?.("canvas[data-engine]")) send("touched");
    }, { capture: true, passive: true });
  // said once, by the chip
  const quieten = () => {
    for (const title of document.querySelectorAll(".mantine-Notification-title")) {
      if (title.textContent !== NOTICE) continue;
      const notice = title.closest(".mantine-Notification-root");
      notice.style.display = "none";
      notice.querySelector(".mantine-Notification-closeButton")?.click();
    }
  };
  quieten();
  new MutationObserver(quieten).observe(document.body, { childList: true, subtree: true });

  let shown = 0;
  return {
    report: (how) => {
      send = how;
      if (matchMedia("(prefers-reduced-motion: reduce)").matches) send("calm");
    },
    still: (faces, head) => {
      shown++;
      still.innerHTML = faces ? window.taBody(faces, head) : "";
      still.classList.toggle("ta-seen", Boolean(faces));
    },
    // the robot is in the scene: once that has been drawn, the still goes
    there: () => {
      const mine = shown;
      const after = (frames) => (frames ? requestAnimationFrame(() => after(frames - 1)) : mine === shown
        && still.classList.remove("ta-seen"));
      after(4);
    },
    say: (text) => { line.textContent = text; },
    chip: (text) => { chip.textContent = text; chip.hidden = !text; },
  };
})();

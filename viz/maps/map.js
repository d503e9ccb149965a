// What maps do in a browser by themselves: the hover card, the keyboard, the enlarged view.
// interaction.py brings it into a page and says what a picture must hold for it.
(() => {
  "use strict";
  if (window.taZoom) return; // it is in the page already

  const REACH = 1.6; // cells: how far from a cell of a nested map the pointer may be
  const ASIDE = 3; // cells straight ahead that one cell aside is worth to an arrow key
  const REST = 220; // ms without another arrow key after which the marked robot is chosen

  // ---- where things are in a picture
  // A picture of thousands of cells holds them as a table: "x,y,i.j.k.l,hint,numbers,faces;..."
  const tableOf = (map) => {
    if (map.taCells) return map.taCells;
    const [w, h] = sizeOf(map);
    const rows = map.dataset.cells.split(";").filter(Boolean);
    map.taHints = JSON.parse(map.dataset.hints);
    map.taCells = rows.map((row) => {
      const [x, y, name, hint, numbers, body, robot] = row.split(",");
      const place = { name: name.replaceAll(".", ","), x: +x, y: +y, w, h, element: map };
      return { ...place, hint: +hint, numbers, body, robot };
    });
    return map.taCells;
  };
  const elementsOf = (map) => {
    const [w, h] = sizeOf(map);
    return Array.from(map.querySelectorAll('[data-filled="1"]'), (element) => {
      const square = element.firstElementChild;
      const [x, y] = [+square.getAttribute("x"), +square.getAttribute("y")];
      return { name: element.dataset.c.split(":")[1], x, y, w, h, element, robot: element.dataset.n };
    });
  };
  const isTable = (map) => map.dataset.cells !== undefined;
  const sizeOf = (map) => map.dataset.size.split(",").map(Number);
  const cellsOf = (map) => (isTable(map) ? tableOf(map) : elementsOf(map));
  const cellNamed = (map, name) => cellsOf(map).find((cell) => cell.name === name);
  const inPicture = (svg, event) => {
    const toScreen = svg.getScreenCTM();
    return toScreen && new DOMPoint(event.clientX, event.clientY).matrixTransform(toScreen.inverse());
  };

  // ---- the hover card
  const card = document.createElement("div");
  card.id = "ta-tip";
  card.style.cssText =
    "position:fixed;display:none;z-index:9999;pointer-events:none;white-space:pre-line;" +
    "font:12px/1.45 system-ui,sans-serif;padding:6px 9px;border-radius:6px;" +
    "background:#161718f5;color:#e6e9ee;border:1px solid #ffffff2e;box-shadow:0 4px 14px #0008;" +
    "font-variant-numeric:tabular-nums";
  const look = document.createElement("style");
  look.textContent =
    "#ta-tip>div::first-line{font-weight:600}#ta-tip svg{display:block;width:190px;max-height:96px;margin-top:4px}";
  document.head.appendChild(look);
  const said = card.appendChild(document.createElement("div"));
  const drawn = card.appendChild(document.createElement("div"));
  let drawnBody = "";

  const hideCard = () => {
    card.style.display = "none";
  };
  // faces: of the robot that is drawn below the text, if any
  const showCard = (event, text, faces = "") => {
    if (said.textContent !== text) said.textContent = text;
    if (faces !== drawnBody) drawn.innerHTML = faces && window.taBody ? window.taBody(faces, -1) : "";
    drawnBody = faces;
    window.taPicture?.(card, event.target); // a page may draw more
    // an open dialog hides all that is not in it
    (event.target.closest("dialog") || document.body).appendChild(card);
    card.style.display = "block";
    let [x, y] = [event.clientX + 14, event.clientY + 16];
    if (x + card.offsetWidth > innerWidth - 6) x = event.clientX - 14 - card.offsetWidth;
    if (y + card.offsetHeight > innerHeight - 6) y = event.clientY - 10 - card.offsetHeight;
    card.style.left = `${Math.max(x, 4)}px`;
    card.style.top = `${Math.max(y, 4)}px`;
  };

  // ---- nested maps: the filled cell that is nearest to the pointer
  const nearest = (map, event) => {
    const pointer = inPicture(map, event);
    if (!pointer) return null;
    let best = null;
    let least = REACH * REACH;
    for (const cell of tableOf(map)) {
      const across = (cell.x + cell.w / 2 - pointer.x) / cell.w;
      const down = (cell.y + cell.h / 2 - pointer.y) / cell.h;
      const far = across * across + down * down;
      if (far < least) [least, best] = [far, cell];
    }
    return best;
  };
  // texts differ in hardly more than their numbers, so one text serves many cells
  const hintOf = (map, cell) => {
    const numbers = cell.numbers.split(" ");
    return map.taHints[cell.hint].replaceAll(map.dataset.mark, () => numbers.shift());
  };
  const mark = (map, cell) => {
    const square = map.querySelector(".ta-near");
    square.setAttribute("x", cell.x);
    square.setAttribute("y", cell.y);
    square.setAttribute("visibility", "visible");
  };
  const unmark = (map) => map?.querySelector(".ta-near")?.setAttribute("visibility", "hidden");

  // ---- diagrams of trends: the generation that is nearest to the pointer
  let readingLine = null;
  const readTrend = (svg, event) => {
    const pointer = inPicture(svg, event);
    const line = svg.querySelector(".ta-at");
    if (!pointer || !line) return false;
    const [width, height] = svg.dataset.plot.split(",").map(Number);
    svg.taPoints ||= JSON.parse(svg.dataset.points);
    let best = null;
    let least = Infinity;
    for (const corner of svg.dataset.plots.split(";")) {
      const [left, top] = corner.split(",").map(Number);
      const [x, y] = [pointer.x - left, pointer.y - top];
      if (x < -9 || x > width + 9 || y < -9 || y > height + 9) continue;
      for (const point of svg.taPoints) {
        const far = Math.abs(point[0] - x);
        if (far < least) [least, best] = [far, point];
      }
    }
    if (!best) return false;
    const [place, text] = best;
    readingLine = line;
    line.setAttribute("visibility", "visible");
    line.setAttribute("transform", `translate(${place} 0)`);
    showCard(event, text);
    return true;
  };

  // ---- the same robot on the other maps
  let lit = [];
  const light = (here, robot) => {
    for (const map of lit) unmark(map);
    lit = [];
    if (!robot) return;
    for (const map of document.querySelectorAll("svg.ta-map")) {
      const cell = map !== here && !map.closest("dialog") && cellsOf(map).find((c) => c.robot === robot);
      if (!cell) continue;
      mark(map, cell);
      lit.push(map);
    }
  };

  // ---- the pointer
  const pointAt = (event) => {
    light(null, null);
    pointAtMap(event);
  };
  const pointAtMap = (event) => {
    const found = event.target.closest?.("[data-h],.ta-nested,[data-points]");
    readingLine?.setAttribute("visibility", "hidden");
    readingLine = null;
    if (!found) return hideCard();
    if (found.dataset.points) return readTrend(found, event) || hideCard();
    if (!isTable(found)) {
      light(mapAround(found), found.dataset.n);
      return showCard(event, found.dataset.h, found.dataset.b);
    }
    const cell = nearest(found, event);
    if (!cell) {
      unmark(found);
      delete found.dataset.c;
      return hideCard();
    }
    found.dataset.c = `${found.dataset.map}:${cell.name}`;
    mark(found, cell);
    light(found, cell.robot);
    showCard(event, hintOf(found, cell), cell.body);
  };
  document.addEventListener("pointermove", pointAt, true);
  document.addEventListener("pointerdown", pointAt, true);
  document.addEventListener("pointerout", (event) => event.relatedTarget || hideCard(), true);

  // ---- the keyboard: the map that has the focus, and the cell that the arrow keys have marked
  const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  let focused = null; // names, because a map that is redrawn is another element
  let marked = null;
  let timer = 0;
  let ours = false; // whether a pointer event is one that a key stands for

  const mapAround = (element) => element?.closest?.("svg.ta-map");
  const focusedMap = () =>
    focused &&
    Array.from(document.querySelectorAll("svg.ta-map")).find(
      (map) => map.dataset.map === focused && !map.closest("dialog"),
    );
  const press = (element, type, place) => {
    ours = true;
    element.dispatchEvent(new PointerEvent(type, { bubbles: true, button: 0, ...place }));
    ours = false;
  };
  const pressCell = (map, cell, type) => {
    const inside = new DOMPoint(cell.x + 0.45 * cell.w, cell.y + 0.45 * cell.h);
    const { x, y } = inside.matrixTransform(map.getScreenCTM());
    press(cell.element, type, { clientX: x, clientY: y });
  };
  // where a style sheet has put the ring of a nested map
  const ringed = (map) => {
    const ring = map.querySelector(".ta-outer~.ta-ring");
    const style = ring && getComputedStyle(ring);
    if (style?.visibility !== "visible") return null;
    const moved = new DOMMatrix(style.transform);
    return cellsOf(map).find(
      (cell) => Math.abs(cell.x - moved.e) < 0.5 && Math.abs(cell.y - moved.f) < 0.5,
    )?.name;
  };
  // the next filled cell, straight ahead rather than aside: empty cells hold nobody up
  const next = (map, from, [right, down]) => {
    let best = null;
    let least = Infinity;
    for (const cell of cellsOf(map)) {
      const [x, y] = [(cell.x - from.x) / from.w, (cell.y - from.y) / from.h];
      const ahead = x * right + y * down;
      const cost = ahead + ASIDE * (Math.abs(x * down) + Math.abs(y * right));
      if (ahead > 0.2 && cost < least) [least, best] = [cost, cell];
    }
    return best;
  };
  const choose = () => {
    clearTimeout(timer);
    const map = focusedMap();
    const cell = map && marked && cellNamed(map, marked);
    if (cell) pressCell(map, cell, "pointerdown");
  };
  const leave = () => {
    unmark(focusedMap());
    focused = marked = null;
    clearTimeout(timer);
  };
  // nothing is simulated for robots that are only passed by: a cell is chosen when the keys have rested
  const step = (map, way) => {
    const known = marked || ringed(map);
    const here = cellNamed(map, known || map.dataset.start);
    if (!here) return;
    // the first key shows where it begins, unless a robot is chosen there
    const there = known || map.dataset.ring ? next(map, here, way) : here;
    if (!there) return;
    marked = there.name;
    there.element.scrollIntoView({ block: "nearest" });
    pressCell(map, there, "pointermove");
    mark(map, there);
    clearTimeout(timer);
    timer = setTimeout(choose, REST);
  };
  const playAndPause = (event) => {
    const key = document.querySelector(".ta-key[data-key=space]");
    if (key && !event.repeat) press(key, "pointerdown");
  };

  document.addEventListener(
    "focusin",
    (event) => {
      const name = mapAround(event.target)?.dataset.map ?? null;
      if (name === focused) return;
      leave();
      focused = name;
    },
    true,
  );
  document.addEventListener(
    "pointerdown",
    (event) => {
      if (ours) return;
      const map = mapAround(event.target);
      if (!map) return leave();
      clearTimeout(timer);
      unmark(map);
      const filled = map.dataset.map === focused && event.target.closest('[data-filled="1"]');
      marked = filled ? filled.dataset.c.split(":")[1] : null;
    },
    true,
  );
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.isComposing) return;
      const active = document.activeElement;
      const map = mapAround(active);
      const isScene = active?.tagName === "CANVAS" || active?.querySelector("canvas");
      if (event.key === " " && (map || isScene || !active || active === document.body)) playAndPause(event);
      else if (!map) return;
      else if (event.key === "Escape") {
        leave();
        hideCard();
        active.blur();
      } else if (event.key === "Enter") {
        marked ||= ringed(map) || map.dataset.start;
        if (!event.repeat) choose();
      } else if (WAYS[event.key]) step(map, WAYS[event.key]);
      else return;
      event.preventDefault();
      event.stopPropagation();
    },
    true,
  );
  // a map that has been redrawn gets back the focus and its marked cell
  new MutationObserver(() => {
    const map = document.activeElement === document.body && focusedMap();
    if (!map) return;
    map.focus({ preventScroll: true });
    const cell = marked && cellNamed(map, marked);
    if (cell) mark(map, cell);
  }).observe(document.body, { childList: true, subtree: true });

  // ---- a map as a file: dark on white, as papers are
  const asText = (svg) => {
    const copy = svg.cloneNode(true);
    const { width, height } = copy.viewBox.baseVal;
    for (const name of ["class", "style", "tabindex", "role", "onpointerdown"]) copy.removeAttribute(name);
    for (const element of [copy, ...copy.querySelectorAll("*")])
      for (const name of Object.keys(element.dataset)) delete element.dataset[name];
    for (const mark of copy.querySelectorAll('[visibility="hidden"]')) mark.remove();
    copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
    copy.setAttribute("class", "ta-map");
    copy.setAttribute("width", width);
    copy.setAttribute("height", height);
    copy.setAttribute("style", "background:#fff;color:#1c2128;font:11px Arial,Helvetica,sans-serif");
    return new XMLSerializer().serializeToString(copy);
  };
  const download = (blob, svg, ending) => {
    const link = document.createElement("a");
    link.href = window.URL.createObjectURL(blob); // in a handler, URL is that of the document
    const run = document.querySelector(".ta-run b")?.textContent ?? "tensatlas";
    link.download = `${run}-${svg.dataset.map}.${ending}`.replace(/[^A-Za-z0-9._-]+/g, "-");
    link.click();
    setTimeout(() => window.URL.revokeObjectURL(link.href), 10000);
  };
  const keepAsSvg = (svg) => download(new Blob([asText(svg)], { type: "image/svg+xml" }), svg, "svg");
  const keepAsPng = (svg) => {
    const { width, height } = svg.viewBox.baseVal;
    const image = new Image();
    image.onload = () => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [4 * width, 4 * height];
      const pen = canvas.getContext("2d");
      pen.fillStyle = "#fff";
      pen.fillRect(0, 0, canvas.width, canvas.height);
      pen.drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => download(blob, svg, "png"), "image/png");
    };
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(asText(svg))}`;
  };

  // ---- the enlarged view
  // what an element stands on: the page may be light or dark
  const groundOf = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const color = getComputedStyle(e).backgroundColor;
      if (!/^transparent$|, 0\)$/.test(color)) return color;
    }
    return "#222324";
  };
  window.taZoom = (button) => {
    const svg = button.closest(".ta-picture").querySelector("svg").cloneNode(true);
    const { width, height } = svg.viewBox.baseVal;
    delete svg.dataset.c;
    if (isTable(svg)) svg.insertAdjacentHTML("beforeend", "<style>.ta-dialog text{font-size:7px}</style>");
    svg.style.width = `min(92vw,calc(${width / height}*(100vh - 100px)))`;
    const close = document.createElement("button");
    close.textContent = "×";
    close.setAttribute("aria-label", "Close");
    close.autofocus = true;
    close.style.cssText =
      "position:absolute;top:4px;right:6px;border:0;background:none;color:inherit;" +
      "font-size:20px;line-height:1;cursor:pointer;outline-offset:-2px";
    const dialog = document.createElement("dialog");
    dialog.className = "ta-dialog";
    dialog.style.cssText =
      `border:1px solid #8b95a355;border-radius:10px;padding:14px 18px;background:${groundOf(button)};` +
      `color:${getComputedStyle(button).color};max-width:none;max-height:none;overflow:hidden`;
    close.onclick = () => dialog.close();
    dialog.onclick = (event) => {
      if (event.target === dialog) dialog.close(); // the ground around it
    };
    dialog.onclose = () => {
      document.body.appendChild(card); // it may lie in the dialog
      hideCard();
      dialog.remove();
    };
    // a chosen robot closes it, when its click has been reported
    svg.addEventListener("pointerdown", (event) => {
      if (event.target.closest('[data-filled="1"]') || svg.dataset.c) setTimeout(() => dialog.close(), 120);
    });
    const files = document.createElement("div");
    files.style.cssText = "display:flex;gap:8px;padding-top:8px";
    for (const [kind, keep] of [["SVG", keepAsSvg], ["PNG", keepAsPng]]) {
      const button = document.createElement("button");
      button.textContent = `Save as ${kind}`;
      button.style.cssText =
        "border:1px solid #8b95a380;border-radius:5px;background:none;color:inherit;font:12px system-ui;" +
        "padding:3px 10px;cursor:pointer";
      button.onclick = () => keep(svg);
      files.append(button);
    }
    dialog.append(svg, files, close);
    document.body.appendChild(dialog);
    dialog.showModal();
  };
})();

// The page of a run: its maps choose a robot, the card says what it is, the player shows it.
(async () => {
  "use strict";
  const byId = (id) => document.getElementById(id);
  const atlas = JSON.parse(byId("atlas").textContent);
  const make = (tag, text = "", name = "") => {
    const element = document.createElement(tag);
    element.textContent = text;
    if (name) element.className = name;
    return element;
  };
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  byId("speed").value = "4";
  byId("aims").hidden = false;
  const player = taReplay.player({ loop: true });
  player.state.playing = !still;
  const failed = byId("stage").appendChild(make("p"));
  failed.id = "failed"; failed.hidden = true;

  // ---- robots, unpacked when they are wanted; the last few are kept
  // the first robot stands before this script, the others behind it
  const whole = new Promise((done) => addEventListener("DOMContentLoaded", done));
  const KEPT = 24, known = new Map();
  const load = (number) => {
    const found = known.get(number);
    known.delete(number);
    known.set(number, found || unpack(number));
    if (known.size > KEPT) known.delete(known.keys().next().value);
    return known.get(number);
  };
  const unpack = async (number) => {
    if (!byId(`r${number}`)) await whole;
    const bytes = taReplay.decoded(byId(`r${number}`).textContent);
    const end = 4 + new DataView(bytes.buffer).getUint32(0, true);
    const robot = JSON.parse(new TextDecoder().decode(await taReplay.inflated(bytes.subarray(4, end))));
    robot.motion = robot.scene && taReplay.motion(robot.scene, await taReplay.inflated(bytes.subarray(end)));
    return robot;
  };

  // ---- words
  const plain = (cm, digits = 1) => (Math.abs(cm) < 0.05 ? 0 : cm).toFixed(digits);
  const signed = (cm) => `${plain(cm) > 0 ? "+" : ""}${plain(cm).replace("-", "−")}`;

  // ---- the card
  let chosen = null, aim = 0, robot = null;
  const tell = () => {
    byId("name").textContent = `Robot ${chosen}`;
    byId("where").textContent = Object.entries(robot.cells).map(([map, cell]) => `${map} ${cell}`).join(" · ");
    const gain = byId("gain");
    const most = make("b", robot.words);
    if (robot.spread !== null) most.append(make("small", ` ± ${plain(robot.spread)}`));
    gain.replaceChildren(most, `${robot.what} f`);
    gain.append(make("sub", "s"), `\u00a0${plain(robot.f_s, 2)}\u00a0cm`);
    byId("facts").replaceChildren(...robot.facts.flatMap(([what, value]) => [make("dt", what), make("dd", value)]));
    byId("network").innerHTML = robot.network; // drawn by TensAtlas, not by the run; no script of it would run
    tellLine();
    tellTargets();
  };
  const tellTargets = () => {
    const most = Math.max(5, ...robot.targets.map((t) => Math.abs(t.gain ?? 0)));
    byId("targets").replaceChildren(...robot.targets.map((target, k) => {
      const row = make("label"), input = make("input"), bar = make("span", "", "bar"), part = bar.appendChild(make("i"));
      Object.assign(input, { type: "radio", name: "aim", value: k, checked: k === aim });
      input.addEventListener("change", () => choose(chosen, k));
      const wide = (50 * Math.abs(target.gain ?? 0)) / most;
      part.style.width = `${wide}%`;
      part.style[target.gain < 0 ? "right" : "left"] = "50%";
      if (target.gain < 0) part.className = "worse";
      const value = target.gain === null ? "failed" : `${signed(target.gain)}${target.spread ? ` ± ${plain(target.spread)}` : ""} cm`;
      row.append(input, make("span", target.name), bar, make("output", value));
      row.title = `Crawl to the target ${target.name}`;
      return row;
    }));
    byId("aim").replaceChildren(...robot.targets.map((target, k) => new Option(target.name, k, false, k === aim)));
  };
  const tellLine = () => {
    const line = robot.lineage;
    byId("length").textContent = line.length > 1 ? `${line.length - 1} ancestor${line.length > 2 ? "s" : ""}` : "no ancestors";
    byId("lineage").replaceChildren(...line.map(([number, generation, f, how], k) => {
      const row = make("li"), what = row.appendChild(make("span"));
      what.append(k && String(number) in atlas.robots ? link(number) : make("b", number), ` · generation ${generation}`);
      const figure = row.appendChild(make("span", f === null ? "failed" : `${plain(f)} cm `, "f"));
      const before = k + 1 < line.length ? line[k + 1][2] : null;
      if (f !== null && before !== null) figure.append(make("span", signed(f - before), f < before ? "bad" : "good"));
      row.append(make("span", how, "how"));
      return row;
    }));
    byId("before").textContent =
      robot.begins === null ? "" : robot.begins ? "Only its last ancestors are shown." : "The run does not hold its earlier ancestors.";
  };
  const link = (number) => {
    const button = make("button", number);
    button.title = `Show robot ${number}`;
    button.addEventListener("click", () => choose(number));
    return button;
  };

  // ---- choosing
  const bestAim = () => robot.targets.reduce((a, t, k, all) => ((t.gain ?? -1e9) > (all[a].gain ?? -1e9) ? k : a), 0);
  const choose = async (number, target = null) => {
    const other = number !== chosen, { keepTime } = { keepTime: !other };
    chosen = number;
    const loaded = await load(number);
    if (chosen !== number) return; // another one has been chosen meanwhile
    robot = loaded;
    aim = robot.targets[target] ? target : bestAim();
    const { trial, failure } = robot.targets[aim];
    failed.hidden = trial !== null;
    byId("view").hidden = trial === null;
    failed.textContent = trial === null ? `The simulation failed: ${failure}` : "";
    if (trial !== null) player.show(robot.motion, trial, { keepTime });
    if (other) {
      tell();
      byId("robot").scrollTop = 0;
      ring();
    } else tellTargets();
    document.title = `Robot ${number} · ${atlas.run} · TensAtlas`;
    history.replaceState(null, "", `#robot=${number}&target=${aim + 1}`);
    document.documentElement.dataset.ready = "1";
  };
  byId("aim").addEventListener("change", (e) => choose(chosen, Number(e.target.value)));
  document.querySelector(".ta-key").addEventListener("pointerdown", player.toggle);

  // ---- the maps
  const cellOf = (element) => {
    const [map, cell] = (element.closest?.("[data-c]")?.dataset.c || ":").split(":");
    return atlas.maps[map]?.[cell];
  };
  const ring = () => {
    for (const map of document.querySelectorAll("svg.ta-map")) {
      map.querySelector(".ta-chosen")?.remove();
      const cells = atlas.maps[map.dataset.map], cell = Object.keys(cells).find((c) => cells[c] === chosen);
      delete map.dataset.ring;
      if (!cell) continue;
      map.dataset.start = cell;
      map.dataset.ring = "1";
      const square = map.querySelector(`[data-c="${map.dataset.map}:${cell}"] rect`).cloneNode();
      square.removeAttribute("fill");
      square.setAttribute("class", "ta-chosen");
      map.append(square);
    }
  };
  // the same maps in other colours lie in templates
  byId("coloring")?.addEventListener("change", (e) => {
    for (const map of document.querySelectorAll("section.map")) {
      const wanted = [...map.querySelectorAll("template")].find((t) => t.dataset.coloring === e.target.value);
      map.querySelector(".drawn").replaceChildren(wanted.content.cloneNode(true));
    }
    ring();
  });
  document.addEventListener("pointerdown", (e) => {
    const number = cellOf(e.target);
    if (number !== undefined && number !== chosen) choose(number);
  });

  // ---- the robot in the hover card: it crawls there, too
  const picture = document.createElement("canvas"), small = taReplay.view(picture, { bare: true });
  let pointed = null, drawn = 0;
  window.taPicture = (card, element) => {
    const number = cellOf(element);
    if (number === undefined) { pointed = null; picture.remove(); return; }
    card.prepend(picture);
    if (number === pointed) return;
    pointed = number;
    picture.getContext("2d").clearRect(0, 0, picture.width, picture.height);
    crawl(number, ++drawn);
  };
  const crawl = async (number, turn) => {
    const { motion, targets } = await load(number);
    if (turn !== drawn || !motion) return;
    const best = targets.reduce((a, t, k, all) => (t.trial !== null && (t.gain ?? -1e9) > (all[a].gain ?? -1e9) ? k : a), 0);
    small.show(motion, targets[best].trial ?? 0);
    small.closeUp(0);
    const began = performance.now();
    const step = (now) => {
      if (turn !== drawn || pointed !== number || !picture.isConnected || !picture.clientWidth) return;
      const time = still ? 0 : (6 * (now - began)) / 1000 % small.last;
      small.draw(time, { light: player.light(), follow: true });
      if (!still) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  };

  // ---- begin with the robot that the address names, or with the best one
  const named = () => {
    const wanted = new URLSearchParams(location.hash.slice(1)), number = Number(wanted.get("robot"));
    const there = wanted.has("robot") && Object.hasOwn(atlas.robots, number);
    return there ? [number, Number(wanted.get("target") || 0) - 1] : [atlas.best, null];
  };
  addEventListener("hashchange", () => choose(...named()));
  await choose(...named());
})();

"use strict";
(async () => {
  const byId = (id) => document.getElementById(id);
  const scene = JSON.parse(byId("scene").textContent);
  const canvas = byId("view"), ctx = canvas.getContext("2d");
  const n = scene.frames, perModule = scene.points, nPoints = scene.modules * perModule;
  const nCables = scene.passive.length + scene.servo.length, last = scene.start + n * scene.period;

  // ---- data: columns of differences in time, low bytes first
  const packed = Uint8Array.from(atob(byId("frames").textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let offset = 0;
  const unpack = (columns) => {
    const size = n * columns, out = new Int16Array(size);
    for (let c = 0; c < columns; c++) {
      let value = 0;
      for (let f = 0; f < n; f++) {
        const i = offset + c * n + f;
        value = (value + bytes[i] + 256 * bytes[i + size]) & 0xffff;
        out[f * columns + c] = value;
      }
    }
    offset += 2 * size;
    return out;
  };
  const positions = unpack(3 * nPoints), tensions = unpack(scene.modules * nCables);

  // ---- the moment that is shown
  const state = { time: scene.start + scene.period, playing: true, speed: 1, follow: false };
  const point = new Float32Array(3 * nPoints), pull = new Float32Array(scene.modules * nCables);
  const centre = [0, 0, 0];
  const place = () => {
    const at = Math.min(Math.max((state.time - scene.start) / scene.period - 1, 0), n - 1);
    const f = Math.floor(at), g = Math.min(f + 1, n - 1), part = at - f;
    for (let i = 0; i < 3 * nPoints; i++) {
      const a = positions[f * 3 * nPoints + i], b = positions[g * 3 * nPoints + i];
      point[i] = scene.origin[i % 3] + scene.step * (a + part * (b - a));
    }
    for (let i = 0; i < pull.length; i++) pull[i] = tensions[f * pull.length + i] / scene.levels;
    centre.fill(0);
    for (let i = 0; i < 3 * nPoints; i++) centre[i % 3] += point[i] / nPoints;
    return f;
  };

  // ---- camera: orbits a point of the ground
  const camera = {};
  // everything that matters: the robot, where its head goes, the target
  const home = () => {
    place();
    const [tx, ty] = scene.target, points = [[tx, ty, 0], [tx, ty, 0.06]];
    for (let i = 0; i < point.length; i += 3) points.push([point[i], point[i + 1], point[i + 2]]);
    for (const [x, y] of scene.heads) points.push([x, y, 0], [x, y, 0.1]);
    const middle = (i) => (Math.min(...points.map((p) => p[i])) + Math.max(...points.map((p) => p[i]))) / 2;
    camera.focus = [middle(0), middle(1), 0.02];
    camera.yaw = scene.walls.length ? Math.atan2(centre[1] - ty, centre[0] - tx) + 0.4 : -2.1;
    camera.pitch = scene.walls.length ? 0.85 : 0.62;
    const inside = (p) => {
      const q = seen(...p);
      return q[2] > 0.1 && Math.abs(q[0] / half[0] - 1) < 0.9 && Math.abs(q[1] / half[1] - 1) < 0.86;
    };
    for (camera.distance = 0.3; camera.distance < 6; camera.distance *= 1.04) {
      aim();
      if (points.every(inside)) break;
    }
    camera.followed = [centre[0], centre[1]];
  };
  let eye, right, up, ahead, scale, half;
  const aim = () => {
    const { yaw, pitch, distance, focus } = camera, c = Math.cos(pitch);
    const out = [Math.cos(yaw) * c, Math.sin(yaw) * c, Math.sin(pitch)];
    eye = focus.map((v, i) => v + distance * out[i]);
    ahead = out.map((v) => -v);
    right = [-Math.sin(yaw), Math.cos(yaw), 0];
    up = [-Math.cos(yaw) * Math.sin(pitch), -Math.sin(yaw) * Math.sin(pitch), c];
    half = [canvas.width / 2, canvas.height / 2];
    scale = 1.25 * Math.min(canvas.height, 1.1 * canvas.width);
  };
  const dot = (a, x, y, z) => a[0] * x + a[1] * y + a[2] * z;
  const seen = (x, y, z) => {
    x -= eye[0]; y -= eye[1]; z -= eye[2];
    const d = dot(ahead, x, y, z), s = scale / Math.max(d, 1e-3);
    return [half[0] + s * dot(right, x, y, z), half[1] - s * dot(up, x, y, z), d, s];
  };
  const NEAR = 0.03;
  const segment = (a, b) => {
    // the part of a line in front of the eye, or null
    const da = dot(ahead, a[0] - eye[0], a[1] - eye[1], a[2] - eye[2]);
    const db = dot(ahead, b[0] - eye[0], b[1] - eye[1], b[2] - eye[2]);
    if (da < NEAR && db < NEAR) return null;
    const cut = (p, q, dp, dq) => p.map((v, i) => v + ((NEAR - dp) / (dq - dp)) * (q[i] - v));
    if (da < NEAR) a = cut(a, b, da, db);
    else if (db < NEAR) b = cut(b, a, db, da);
    return [seen(...a), seen(...b)];
  };

  // ---- drawing, the farthest first
  const css = (c, k = 1, alpha = 1) =>
    `rgba(${Math.min(255, c[0] * k) | 0},${Math.min(255, c[1] * k) | 0},${Math.min(255, c[2] * k) | 0},${alpha})`;
  const mix = (a, b, t) => a.map((v, i) => v + t * (b[i] - v));
  const light = () => document.documentElement.classList.contains("light");
  const stroke = (a, b, width, color) => {
    ctx.strokeStyle = color; ctx.lineWidth = width;
    ctx.beginPath(); ctx.moveTo(a[0], a[1]); ctx.lineTo(b[0], b[1]); ctx.stroke();
  };
  const ground = () => {
    const reach = Math.min(Math.max(1.3 * camera.distance, 0.6), 4), pitch = reach > 2 ? 0.25 : 0.05;
    const cx = Math.round(camera.focus[0] / 0.25) * 0.25, cy = Math.round(camera.focus[1] / 0.25) * 0.25;
    const m = Math.ceil(reach / pitch), base = light() ? [90, 105, 125] : [130, 142, 160];
    ctx.lineCap = "butt";
    for (let k = -m; k <= m; k++) {
      for (const across of [0, 1]) {
        const c = (across ? cy : cx) + k * pitch, strong = Math.abs(c / 0.25 - Math.round(c / 0.25)) < 1e-6;
        const side = Math.sqrt(Math.max(0, reach * reach - (k * pitch) ** 2));
        const steps = 6;
        for (let s = 0; s < steps; s++) {
          const u = side * (2 * s / steps - 1), v = side * (2 * (s + 1) / steps - 1);
          const line = across ? segment([cx + u, c, 0], [cx + v, c, 0]) : segment([c, cy + u, 0], [c, cy + v, 0]);
          if (!line) continue;
          const far = Math.hypot((u + v) / 2, k * pitch) / reach, fade = (1 - far) * (strong ? 0.42 : 0.17);
          if (fade > 0.01) stroke(line[0], line[1], ratio * (strong ? 1.2 : 0.8), css(base, 1, fade));
        }
      }
    }
  };
  const disc = (x, y, radius, fill, edge) => {
    ctx.beginPath();
    for (let k = 0; k <= 32; k++) {
      const a = (k / 32) * 2 * Math.PI, q = seen(x + radius * Math.cos(a), y + radius * Math.sin(a), 0.001);
      k ? ctx.lineTo(q[0], q[1]) : ctx.moveTo(q[0], q[1]);
    }
    ctx.fillStyle = fill; ctx.fill();
    if (edge) { ctx.strokeStyle = edge; ctx.lineWidth = 1.5 * ratio; ctx.stroke(); }
  };
  const trail = (frame) => {
    if (!byId("trail").checked) return;
    const first = Math.max(Math.round(-scene.start / scene.period) - 1, 0);
    ctx.lineCap = ctx.lineJoin = "round";
    ctx.beginPath();
    let begun = false;
    for (let f = first; f <= frame; f++) {
      const q = seen(scene.heads[f][0], scene.heads[f][1], 0.002);
      if (q[2] < NEAR) { begun = false; continue; }
      begun ? ctx.lineTo(q[0], q[1]) : ctx.moveTo(q[0], q[1]);
      begun = true;
    }
    ctx.strokeStyle = css(scene.colors.trail); ctx.lineWidth = 2.4 * ratio; ctx.stroke();
  };
  const at = (m, k) => { const i = 3 * (m * perModule + k); return [point[i], point[i + 1], point[i + 2]]; };
  const shadows = () => {
    ctx.lineCap = "round";
    const dark = light() ? "rgba(30,40,55,.13)" : "rgba(0,0,0,.38)";
    for (let m = 0; m < scene.modules; m++) for (const [a, b] of scene.rods) {
      const p = at(m, a), q = at(m, b), line = segment([p[0], p[1], 0], [q[0], q[1], 0]);
      if (line) stroke(line[0], line[1], 3.4 * scene.radius.rod * line[0][3], dark);
    }
  };
  const parts = () => {
    const list = [], C = scene.colors, showTension = byId("tension").checked, bright = light() ? 0.82 : 1;
    const add = (a, b, draw, lift = 0) => {
      const line = segment(a, b);
      if (line) list.push([(line[0][2] + line[1][2]) / 2 - lift, draw, line]);
    };
    for (let m = 0; m < scene.modules; m++) {
      scene.rods.forEach(([a, b], r) => {
        const color = scene.rodColors[m * scene.rods.length + r];
        add(at(m, a), at(m, b), ([p, q]) => {
          const w = 2 * scene.radius.rod * (p[3] + q[3]) / 2;
          ctx.lineCap = "round";
          stroke(p, q, Math.max(w, 1.5 * ratio), css(color, 0.5 * bright));
          stroke(p, q, Math.max(0.72 * w, ratio), css(color, 0.86 * bright));
          const o = 0.17 * w;
          stroke([p[0] - o, p[1] - o], [q[0] - o, q[1] - o], Math.max(0.26 * w, 0.5), css(mix(color, [255, 255, 255], 0.45), bright));
        });
      });
      [...scene.passive, ...scene.servo].forEach(([a, b], c) => {
        const servo = c >= scene.passive.length;
        const t = showTension ? pull[m * nCables + c] : 0.7;
        const color = servo ? mix(C.servoSlack, C.servoTaut, t) : mix(light() ? [168, 184, 204] : C.slack, light() ? [28, 92, 170] : C.taut, t);
        add(at(m, a), at(m, b), ([p, q]) => {
          ctx.lineCap = "butt";
          stroke(p, q, Math.max(0.0013 * (p[3] + q[3]) / 2, 0.8 * ratio), css(color));
        });
      });
      for (let k = 0; k < perModule; k++) {
        const p = at(m, k), isServo = k === perModule - 1;
        const q = seen(...p);
        if (q[2] > NEAR) list.push([q[2] - 0.002, () => {
          const r = (isServo ? scene.radius.servo : scene.radius.node) * q[3], color = isServo ? C.servo : C.node;
          ctx.fillStyle = css(color, 0.62 * bright);
          ctx.beginPath(); ctx.arc(q[0], q[1], r, 0, 7); ctx.fill();
          ctx.fillStyle = css(color, bright);
          ctx.beginPath(); ctx.arc(q[0] - 0.16 * r, q[1] - 0.18 * r, 0.74 * r, 0, 7); ctx.fill();
        }]);
      }
    }
    if (state.time >= 0) {
      const [x, y] = scene.target;
      add([x, y, 0.001], [x, y, 0.06], ([p, q]) => {
        ctx.lineCap = "round";
        stroke(p, q, 0.016 * p[3], css(C.target, bright, 0.85));
        stroke([p[0] - 0.003 * p[3], p[1]], [q[0] - 0.003 * q[3], q[1]], 0.004 * p[3], "rgba(255,255,255,.5)");
      });
      for (const wall of scene.walls) walls(list, wall);
    }
    return list.sort((a, b) => b[0] - a[0]);
  };
  const walls = (list, [x, y, z, hx, hy, hz, yaw]) => {
    const c = Math.cos(yaw), s = Math.sin(yaw);
    const corner = (i, j, k) => [x + c * i * hx - s * j * hy, y + s * i * hx + c * j * hy, z + k * hz];
    for (const axis of [0, 1, 2]) for (const side of [-1, 1]) {
      const ring = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => {
        const v = [0, 0, 0]; v[axis] = side; v[(axis + 1) % 3] = a; v[(axis + 2) % 3] = b;
        return corner(...v);
      });
      const q = ring.map((p) => seen(...p));
      if (q.some((p) => p[2] < NEAR)) continue;
      const nearest = Math.min(...q.map((p) => p[2]));
      list.push([(nearest + q.reduce((a, p) => a + p[2], 0) / 4) / 2, () => {
        ctx.beginPath();
        q.forEach((p, i) => (i ? ctx.lineTo(p[0], p[1]) : ctx.moveTo(p[0], p[1])));
        ctx.closePath();
        ctx.fillStyle = css(scene.colors.wall, light() ? 0.7 : 1, 0.13); ctx.fill();
        ctx.strokeStyle = css(scene.colors.wall, light() ? 0.6 : 1.2, 0.55); ctx.lineWidth = ratio; ctx.stroke();
      }]);
    }
  };
  let ratio = 1;
  const fit = () => {
    ratio = Math.min(devicePixelRatio || 1, 2);
    const w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  };
  const draw = () => {
    fit();
    const frame = place();
    if (state.follow) for (const i of [0, 1]) camera.focus[i] += centre[i] - camera.followed[i];
    camera.followed = [centre[0], centre[1]];
    aim();
    ctx.fillStyle = light() ? "#eef1f4" : "#171a1f";
    ctx.fillRect(0, 0, canvas.width, canvas.height);
    ground();
    if (state.time >= 0) disc(scene.target[0], scene.target[1], 0.02, css(scene.colors.target, 1, 0.25), css(scene.colors.target, 1, 0.9));
    trail(frame);
    shadows();
    for (const [, paint, line] of parts()) paint(line);
    const head = scene.heads[frame], away = 100 * Math.hypot(head[0] - scene.target[0], head[1] - scene.target[1]);
    byId("away").textContent = state.time < 0 ? "settling" : `The head is ${away.toFixed(1)} cm from the target.`;
    byId("clock").textContent = `${state.time.toFixed(1)} of ${last.toFixed(0)} s`;
    if (document.activeElement !== byId("time") || state.playing) byId("time").value = state.time;
    byId("play").textContent = state.playing ? "Pause" : "Play";
  };

  // ---- what the user does
  let dirty = true, before = null;
  const redraw = () => { dirty = true; };
  const toggle = () => {
    if (!state.playing && state.time >= last - 1e-6) state.time = scene.start + scene.period;
    state.playing = !state.playing; redraw();
  };
  const seek = (time) => { state.time = Math.min(Math.max(time, scene.start + scene.period), last); redraw(); };
  const bar = byId("time");
  bar.min = scene.start + scene.period; bar.max = last;
  bar.addEventListener("input", () => { state.playing = false; seek(Number(bar.value)); });
  byId("play").addEventListener("click", toggle);
  byId("speed").addEventListener("change", (e) => { state.speed = Number(e.target.value); });
  byId("follow").addEventListener("change", (e) => { state.follow = e.target.checked; redraw(); });
  for (const id of ["trail", "tension"]) byId(id).addEventListener("change", redraw);
  const dress = (bright) => {
    document.documentElement.classList.toggle("light", bright);
    byId("shade").textContent = bright ? "Dark" : "Light"; redraw();
  };
  byId("shade").addEventListener("click", () => dress(!light()));
  dress(matchMedia("(prefers-color-scheme: light)").matches);
  addEventListener("keydown", (e) => {
    if (["INPUT", "SELECT", "BUTTON"].includes(document.activeElement.tagName)) return;
    if (e.key === " ") toggle();
    else if (e.key === "ArrowLeft" || e.key === "ArrowRight") { state.playing = false; seek(state.time + (e.key === "ArrowLeft" ? -0.2 : 0.2)); }
    else return;
    e.preventDefault();
  });
  const fingers = new Map();
  const spread = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  const zoom = (factor) => { camera.distance = Math.min(Math.max(camera.distance * factor, 0.12), 8); redraw(); };
  canvas.addEventListener("pointerdown", (e) => { fingers.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointermove", (e) => {
    const old = fingers.get(e.pointerId);
    if (!old) return;
    if (fingers.size === 2) {
      const was = spread();
      fingers.set(e.pointerId, [e.clientX, e.clientY]);
      zoom(was / Math.max(spread(), 1));
      return;
    }
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    camera.yaw -= 0.008 * (e.clientX - old[0]);
    camera.pitch = Math.min(Math.max(camera.pitch + 0.008 * (e.clientY - old[1]), 0.03), 1.55);
    redraw();
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(0.0012 * e.deltaY)); }, { passive: false });
  canvas.addEventListener("dblclick", () => { home(); redraw(); });
  new ResizeObserver(redraw).observe(canvas);
  fit();
  home();
  const tick = (now) => {
    if (state.playing && before !== null) {
      state.time += state.speed * Math.min((now - before) / 1000, 0.25);
      if (state.time >= last) { state.time = last; state.playing = false; }
      dirty = true;
    }
    before = now;
    if (dirty) { dirty = false; draw(); }
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
  document.documentElement.dataset.ready = "1";
})();

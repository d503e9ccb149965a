// Plays robots on a canvas: unpacks their motion, draws them the farthest part first, runs the controls.
// Both the page of one replay and the page of an atlas begin with this file. What they hand to it is made by
// motion.py (the scene and its trials) and packing.py (the columns).
const taReplay = (() => {
  "use strict";

  // ---- data
  const decoded = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const inflated = async (packed) => {
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  // Returns per trial its columns, frame by frame: what packing.py wrote. All arithmetic is in whole numbers.
  const unpack = (bytes, frames, nColumns, { taps, unit }) => {
    const whole = frames.reduce((a, b) => a + b, 0);
    const weights = new Int8Array(bytes.buffer, bytes.byteOffset + taps * nColumns, taps * nColumns);
    const low = 2 * taps * nColumns, high = low + whole * nColumns;
    const steps = new Int16Array(whole * nColumns), guess = new Int32Array(whole);
    for (let c = 0; c < nColumns; c++) {
      guess.fill(unit / 2);
      for (let tap = 0; tap < taps; tap++) {
        const weight = weights[c * taps + tap], from = (c - bytes[c * taps + tap]) * whole;
        if (weight) for (let f = 0; f < whole; f++) guess[f] += weight * steps[from + f];
      }
      for (let f = 0, i = c * whole; f < whole; f++, i++) {
        const folded = bytes[low + i] + 256 * bytes[high + i];
        steps[i] = Math.floor(guess[f] / unit) + ((folded >> 1) ^ -(folded & 1)); // wraps as in Python
      }
    }
    let first = 0;
    return frames.map((n) => {
      const out = new Int16Array(n * nColumns);
      for (let c = 0; c < nColumns; c++) {
        for (let f = 0, value = 0; f < n; f++) {
          value += steps[c * whole + first + f];
          out[f * nColumns + c] = value;
        }
      }
      first += n;
      return out;
    });
  };

  // A robot with its trials; `place` says where its points are at a moment and how its cables pull.
  const motion = (scene, bytes) => {
    const perModule = scene.points, nPoints = scene.modules * perModule, nCables = scene.passive.length + scene.servo.length;
    const told = scene.told, nColumns = 3 * nPoints + told * scene.modules;
    const columns = unpack(bytes, scene.trials.map((t) => t.frames), nColumns, scene.packing);
    const trials = scene.trials.map((trial, k) => {
      const values = columns[k], n = trial.frames;
      const where = (time) => {
        const at = Math.min(Math.max((time - scene.start) / scene.period - 1, 0), n - 1);
        return [Math.floor(at), at - Math.floor(at)];
      };
      // along a smooth curve through the recorded places
      const place = (time, point, pull) => {
        const [f, t] = where(time), row = (g) => Math.min(Math.max(g, 0), n - 1) * nColumns;
        const r0 = row(f - 1), r1 = row(f), r2 = row(f + 1), r3 = row(f + 2);
        for (let i = 0; i < 3 * nPoints; i++) {
          const a = values[r0 + i], b = values[r1 + i], c = values[r2 + i], d = values[r3 + i];
          const bend = 2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a);
          point[i] = scene.origin[i % 3] + scene.step * (b + 0.5 * t * (c - a + t * bend));
        }
        if (pull) {
          for (let m = 0; m < scene.modules; m++) for (let c = 0; c < nCables; c++) {
            const stored = c - (nCables - told);
            pull[m * nCables + c] = stored < 0
              ? stretch(point, m, scene.passive[c])
              : values[r1 + 3 * nPoints + m * told + stored] / scene.levels;
          }
        }
        return f;
      };
      // how taut a passive cable is, from the distance of its nodes
      const stretch = (point, m, [a, b]) => {
        const i = 3 * (m * perModule + a), j = 3 * (m * perModule + b);
        const length = Math.hypot(point[i] - point[j], point[i + 1] - point[j + 1], point[i + 2] - point[j + 2]);
        return Math.min(Math.max((scene.stiffness[m] * (length - scene.slack)) / scene.reach, 0), 1);
      };
      const heads = Array.from({ length: n }, (_, f) => [0, 1].map((axis) => {
        let sum = 0;
        for (const rod of scene.front) for (const node of scene.rods[rod]) {
          sum += values[f * nColumns + 3 * (scene.head * perModule + node) + axis];
        }
        return scene.origin[axis] + (scene.step * sum) / (2 * scene.front.length);
      }));
      return { ...trial, heads, place, frameAt: (time) => where(time)[0] };
    });
    const last = (k) => scene.start + trials[k].frames * scene.period;
    return { scene, trials, nPoints, nCables, last };
  };

  // ---- drawing
  const NEAR = 0.03;
  const THEMES = {
    dark: {
      sky: "#20252d", ground: "#14171c", line: [150, 164, 186], shadow: "#000", depth: 0.4, contact: "rgba(0,0,0,.5)",
      slack: [48, 60, 80], taut: [92, 156, 222], bright: 1, text: "#e6e9ee", halo: "rgba(20,23,28,.85)",
    },
    light: {
      sky: "#fbfcfd", ground: "#e4e9ee", line: [82, 99, 122], shadow: "#33415a", depth: 0.15, contact: "rgba(30,40,58,.25)",
      slack: [168, 184, 204], taut: [28, 92, 170], bright: 0.82, text: "#1d2430", halo: "rgba(255,255,255,.85)",
    },
  };
  const css = (c, k = 1, alpha = 1) =>
    `rgba(${Math.min(255, c[0] * k) | 0},${Math.min(255, c[1] * k) | 0},${Math.min(255, c[2] * k) | 0},${alpha})`;
  const mix = (a, b, t) => a.map((v, i) => v + t * (b[i] - v));
  const dot = (a, x, y, z) => a[0] * x + a[1] * y + a[2] * z;

  // A camera and a brush for one canvas. `look` says what is drawn besides the robot.
  const view = (canvas, look = {}) => {
    const ctx = canvas.getContext("2d"), camera = { focus: [0, 0, 0.02], yaw: -2.1, pitch: 0.62, distance: 1 };
    const centre = [0, 0, 0];
    let robot = null, trial = null, k = 0, point = null, pull = null, ratio = 1, T = THEMES.dark;
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
    const seen = (x, y, z) => {
      x -= eye[0]; y -= eye[1]; z -= eye[2];
      const d = dot(ahead, x, y, z), s = scale / Math.max(d, 1e-3);
      return [half[0] + s * dot(right, x, y, z), half[1] - s * dot(up, x, y, z), d, s];
    };
    // the part of a line in front of the eye, or null
    const segment = (a, b) => {
      const da = dot(ahead, a[0] - eye[0], a[1] - eye[1], a[2] - eye[2]);
      const db = dot(ahead, b[0] - eye[0], b[1] - eye[1], b[2] - eye[2]);
      if (da < NEAR && db < NEAR) return null;
      const cut = (p, q, dp, dq) => p.map((v, i) => v + ((NEAR - dp) / (dq - dp)) * (q[i] - v));
      if (da < NEAR) a = cut(a, b, da, db);
      else if (db < NEAR) b = cut(b, a, db, da);
      return [seen(...a), seen(...b)];
    };

    const put = (time) => {
      const frame = trial.place(time, point, pull);
      centre.fill(0);
      for (let i = 0; i < point.length; i++) centre[i % 3] += (3 * point[i]) / point.length;
      return frame;
    };
    const at = (m, node) => {
      const i = 3 * (m * robot.scene.points + node);
      return [point[i], point[i + 1], point[i + 2]];
    };
    const fit = () => {
      ratio = Math.min(devicePixelRatio || 1, 2);
      const w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
      if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    };
    // moves the camera until points lie within a part of the picture
    const frameUp = (points, [x, y]) => {
      const middle = (i) => (Math.min(...points.map((p) => p[i])) + Math.max(...points.map((p) => p[i]))) / 2;
      camera.focus = [middle(0), middle(1), look.bare ? middle(2) : 0.02];
      const inside = (p) => {
        const q = seen(...p);
        return q[2] > 0.1 && Math.abs(q[0] / half[0] - 1) < x && Math.abs(q[1] / half[1] - 1) < y;
      };
      // then sideways and forth, to where they are in the middle as they are seen, and once more
      for (const last of [false, true]) {
        for (camera.distance = 0.2; camera.distance < 6; camera.distance *= 1.03) {
          aim();
          if (points.every(inside)) break;
        }
        if (last) break;
        const spots = points.map((p) => seen(...p)), s = scale / camera.distance;
        const off = (axis) => {
          const places = spots.map((q) => q[axis]);
          return (Math.min(...places) + Math.max(...places)) / 2 - half[axis];
        };
        const across = off(0) / s, forth = -off(1) / (s * Math.sin(camera.pitch));
        camera.focus[0] += across * right[0] - forth * Math.cos(camera.yaw);
        camera.focus[1] += across * right[1] - forth * Math.sin(camera.yaw);
      }
      camera.followed = [centre[0], centre[1]];
    };
    const robotPoints = () => Array.from({ length: point.length / 3 }, (_, i) => [point[3 * i], point[3 * i + 1], point[3 * i + 2]]);
    // everything that matters: the robot, where its head goes, the target
    const home = () => {
      fit();
      put(robot.scene.start + robot.scene.period);
      const [tx, ty] = trial.target, among = trial.walls.length > 0;
      camera.yaw = among ? Math.atan2(centre[1] - ty, centre[0] - tx) + 0.4 : -2.1;
      camera.pitch = among ? 0.85 : 0.62;
      const way = trial.heads.flatMap(([x, y]) => [[x, y, 0], [x, y, 0.1]]);
      frameUp([[tx, ty, 0], [tx, ty, 0.09], ...robotPoints(), ...way], [0.9, 0.84]);
    };
    // the robot alone
    const closeUp = (time) => {
      fit();
      put(time);
      // from its side, a little from the front
      const per = robot.scene.points, tail = robot.scene.head ? 0 : robot.scene.modules - 1, whole = robotPoints();
      const middle = (m, axis) => whole.slice(per * m, per * (m + 1)).reduce((sum, p) => sum + p[axis], 0);
      const [dx, dy] = [0, 1].map((axis) => middle(robot.scene.head, axis) - middle(tail, axis));
      camera.yaw = Math.atan2(dy, dx) - 1.2;
      camera.pitch = 0.42;
      frameUp(whole, [0.84, 0.84]);
    };

    const stroke = (a, b, width, color) => {
      ctx.strokeStyle = color; ctx.lineWidth = width;
      ctx.beginPath(); ctx.moveTo(a[0], a[1]); ctx.lineTo(b[0], b[1]); ctx.stroke();
    };
    const backdrop = () => {
      const wash = ctx.createLinearGradient(0, 0, 0, canvas.height);
      wash.addColorStop(0, T.sky); wash.addColorStop(1, T.ground);
      ctx.fillStyle = wash;
      ctx.fillRect(0, 0, canvas.width, canvas.height);
    };
    const ground = () => {
      const reach = Math.min(Math.max(1.5 * camera.distance, 0.6), 4), pitch = reach > 2 ? 0.25 : 0.05;
      const cx = Math.round(camera.focus[0] / 0.25) * 0.25, cy = Math.round(camera.focus[1] / 0.25) * 0.25;
      const m = Math.ceil(reach / pitch), steps = 10;
      ctx.lineCap = "butt";
      for (let j = -m; j <= m; j++) {
        for (const across of [0, 1]) {
          const c = (across ? cy : cx) + j * pitch, strong = Math.abs(c / 0.25 - Math.round(c / 0.25)) < 1e-6;
          const side = Math.sqrt(Math.max(0, reach * reach - (j * pitch) ** 2));
          for (let s = 0; s < steps; s++) {
            const u = side * ((2 * s) / steps - 1), v = side * ((2 * (s + 1)) / steps - 1);
            const far = Math.hypot((u + v) / 2, j * pitch) / reach, fade = (1 - far) ** 1.5 * (strong ? 0.5 : 0.2);
            if (fade < 0.012) continue;
            const line = across ? segment([cx + u, c, 0], [cx + v, c, 0]) : segment([c, cy + u, 0], [c, cy + v, 0]);
            if (line) stroke(line[0], line[1], ratio * (strong ? 1.2 : 0.8), css(T.line, 1, fade));
          }
        }
      }
    };
    const disc = (x, y, radius, fill, edge) => {
      ctx.beginPath();
      for (let j = 0; j <= 32; j++) {
        const a = (j / 32) * 2 * Math.PI, q = seen(x + radius * Math.cos(a), y + radius * Math.sin(a), 0.001);
        if (q[2] < NEAR) return;
        j ? ctx.lineTo(q[0], q[1]) : ctx.moveTo(q[0], q[1]);
      }
      ctx.fillStyle = fill; ctx.fill();
      if (edge) { ctx.strokeStyle = edge; ctx.lineWidth = 1.5 * ratio; ctx.stroke(); }
    };
    const trail = (frame) => {
      const { scene } = robot, first = Math.max(Math.round(-scene.start / scene.period) - 1, 0);
      ctx.lineCap = ctx.lineJoin = "round";
      ctx.beginPath();
      let begun = false;
      for (let f = first; f <= frame; f++) {
        const q = seen(trial.heads[f][0], trial.heads[f][1], 0.002);
        if (q[2] < NEAR) { begun = false; continue; }
        begun ? ctx.lineTo(q[0], q[1]) : ctx.moveTo(q[0], q[1]);
        begun = true;
      }
      ctx.strokeStyle = css(scene.colors.trail); ctx.lineWidth = 2.4 * ratio; ctx.stroke();
    };
    // a dashed line on the ground that shrinks as the head comes nearer
    const wayToGo = (frame) => {
      const head = trial.heads[frame], line = segment([head[0], head[1], 0.002], [...trial.target, 0.002]);
      if (!line) return;
      ctx.setLineDash([2 * ratio, 6 * ratio]);
      ctx.lineCap = "round";
      stroke(line[0], line[1], 1.6 * ratio, css(robot.scene.colors.target, T.bright, 0.8));
      ctx.setLineDash([]);
    };
    // drawn small, so that enlarging blurs them, and at once, so that they do not add up
    const shade = document.createElement("canvas"), brush = shade.getContext("2d");
    const shadows = () => {
      const { scene } = robot, { width, height } = canvas;
      for (const [coarse, softness] of [[5, 1], [14, 3]]) {
        shade.width = Math.ceil(width / coarse); shade.height = Math.ceil(height / coarse);
        brush.lineCap = "round"; brush.strokeStyle = T.shadow;
        for (let m = 0; m < scene.modules; m++) for (const [a, b] of scene.rods) {
          const p = at(m, a), q = at(m, b), line = segment([p[0], p[1], 0], [q[0], q[1], 0]);
          if (!line) continue;
          // the higher a rod, the wider its shadow
          brush.lineWidth = ((3 + 50 * softness * Math.max((p[2] + q[2]) / 2, 0)) * scene.radius.rod * line[0][3]) / coarse;
          brush.beginPath(); brush.moveTo(line[0][0] / coarse, line[0][1] / coarse);
          brush.lineTo(line[1][0] / coarse, line[1][1] / coarse); brush.stroke();
        }
        ctx.globalAlpha = T.depth;
        ctx.drawImage(shade, 0, 0, shade.width * coarse, shade.height * coarse);
        ctx.globalAlpha = 1;
      }
      for (let m = 0; m < scene.modules; m++) for (let node = 0; node < scene.points - 1; node++) {
        const [x, y, z] = at(m, node);
        if (z < 0.012) disc(x, y, 1.9 * scene.radius.node, T.contact);
      }
    };
    const parts = (showTension, begun) => {
      const { scene } = robot, list = [], C = scene.colors, bright = T.bright;
      const add = (a, b, draw) => {
        const line = segment(a, b);
        if (line) list.push([(line[0][2] + line[1][2]) / 2, draw, line]);
      };
      for (let m = 0; m < scene.modules; m++) {
        scene.rods.forEach(([a, b], r) => {
          const color = scene.rodColors[m * scene.rods.length + r];
          add(at(m, a), at(m, b), ([p, q]) => {
            const w = scene.radius.rod * (p[3] + q[3]);
            ctx.lineCap = "round";
            stroke(p, q, Math.max(w, 1.5 * ratio), css(color, 0.5 * bright));
            stroke(p, q, Math.max(0.72 * w, ratio), css(color, 0.86 * bright));
            const o = 0.17 * w;
            stroke([p[0] - o, p[1] - o], [q[0] - o, q[1] - o], Math.max(0.26 * w, 0.5), css(mix(color, [255, 255, 255], 0.45), bright));
          });
        });
        [...scene.passive, ...scene.servo].forEach(([a, b], c) => {
          const t = showTension ? pull[m * robot.nCables + c] : 0.7;
          const color = c >= scene.passive.length ? mix(C.servoSlack, C.servoTaut, t) : mix(T.slack, T.taut, t);
          add(at(m, a), at(m, b), ([p, q]) => {
            ctx.lineCap = "butt";
            stroke(p, q, Math.max(0.00065 * (p[3] + q[3]), 0.8 * ratio), css(color));
          });
        });
        for (let node = 0; node < scene.points; node++) {
          const q = seen(...at(m, node)), isServo = node === scene.points - 1;
          if (q[2] > NEAR) list.push([q[2] - 0.002, () => {
            const r = (isServo ? scene.radius.servo : scene.radius.node) * q[3], color = isServo ? C.servo : C.node;
            ctx.fillStyle = css(color, 0.62 * bright);
            ctx.beginPath(); ctx.arc(q[0], q[1], r, 0, 7); ctx.fill();
            ctx.fillStyle = css(color, bright);
            ctx.beginPath(); ctx.arc(q[0] - 0.16 * r, q[1] - 0.18 * r, 0.74 * r, 0, 7); ctx.fill();
          }]);
        }
      }
      if (begun) {
        const [x, y] = trial.target;
        add([x, y, 0.001], [x, y, 0.07], ([p, q]) => {
          ctx.lineCap = "round";
          stroke(p, q, 0.011 * p[3], css(C.target, bright, 0.9));
          stroke([p[0] - 0.002 * p[3], p[1]], [q[0] - 0.002 * q[3], q[1]], 0.003 * p[3], "rgba(255,255,255,.5)");
        });
        for (const wall of trial.walls) walls(list, wall);
      }
      return list.sort((a, b) => b[0] - a[0]);
    };
    const walls = (list, [x, y, z, hx, hy, hz, yaw]) => {
      const c = Math.cos(yaw), s = Math.sin(yaw), light = T === THEMES.light, wall = robot.scene.colors.wall;
      const corner = (i, j, l) => [x + c * i * hx - s * j * hy, y + s * i * hx + c * j * hy, z + l * hz];
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
          ctx.fillStyle = css(wall, light ? 0.7 : 1, 0.13); ctx.fill();
          ctx.strokeStyle = css(wall, light ? 0.6 : 1.2, 0.55); ctx.lineWidth = ratio; ctx.stroke();
        }]);
      }
    };
    const note = (x, y, z, text) => {
      const q = seen(x, y, z);
      if (q[2] < NEAR) return;
      ctx.font = `600 ${12.5 * ratio}px system-ui,sans-serif`;
      ctx.textAlign = "center";
      ctx.lineJoin = "round"; ctx.lineWidth = 4 * ratio; ctx.strokeStyle = T.halo;
      ctx.strokeText(text, q[0], q[1]);
      ctx.fillStyle = T.text;
      ctx.fillText(text, q[0], q[1]);
    };

    // Draws a moment; returns how far the head is from the target, in m.
    const draw = (time, { light, follow = false, showTrail = true, showTension = true }) => {
      T = light ? THEMES.light : THEMES.dark;
      fit();
      const frame = put(time), begun = time >= 0 && !look.bare, head = trial.heads[frame];
      const away = Math.hypot(head[0] - trial.target[0], head[1] - trial.target[1]);
      if (follow) for (const i of [0, 1]) camera.focus[i] += centre[i] - camera.followed[i];
      camera.followed = [centre[0], centre[1]];
      aim();
      if (look.bare) ctx.clearRect(0, 0, canvas.width, canvas.height);
      else { backdrop(); ground(); }
      const C = robot.scene.colors;
      if (begun) {
        wayToGo(frame);
        disc(...trial.target, 0.02, css(C.target, 1, 0.25), css(C.target, T.bright, 0.9));
      }
      shadows();
      if (begun && showTrail) trail(frame);
      for (const [, paint, line] of parts(showTension, begun)) paint(line);
      if (begun) note(...trial.target, 0.085, `${(100 * away).toFixed(1)} cm`);
      return away;
    };
    const show = (which, number) => {
      robot = which; k = number; trial = robot.trials[k];
      point = new Float32Array(3 * robot.nPoints);
      pull = new Float32Array(robot.scene.modules * robot.nCables);
    };
    return {
      camera, home, closeUp, draw, show,
      get shown() { return robot; },
      get last() { return robot.last(k); },
      get points() { return point; },
    };
  };

  // The page's one player: the canvas "view" and the controls around it, by their ids.
  const player = ({ loop = false } = {}) => {
    const byId = (id) => document.getElementById(id);
    const canvas = byId("view"), stage = view(canvas), camera = stage.camera;
    const state = { time: 0, playing: true, speed: Number(byId("speed").value), follow: false, wait: 0 };
    const bar = byId("time");
    let first = 0, last = 0, dirty = false, before = null;
    const light = () => document.documentElement.classList.contains("light");
    const redraw = () => { dirty = true; };
    const options = () => ({
      light: light(), follow: state.follow, showTrail: byId("trail").checked, showTension: byId("tension").checked,
    });
    const draw = () => {
      if (!stage.shown) return;
      const away = stage.draw(state.time, options());
      const told = byId("away"); // the atlas says it in the scene alone
      if (told) told.textContent = state.time < 0 ? "settling" : `The head is ${(100 * away).toFixed(1)} cm from the target.`;
      byId("clock").textContent = `${state.time.toFixed(1)} of ${last.toFixed(0)} s`;
      if (document.activeElement !== bar || state.playing) bar.value = state.time;
      byId("play").textContent = state.playing ? "Pause" : "Play";
    };
    const toggle = () => {
      if (!state.playing && state.time >= last - 1e-6) state.time = first;
      state.playing = !state.playing; redraw();
    };
    const seek = (time) => { state.time = Math.min(Math.max(time, first), last); redraw(); };
    const show = (robot, k, { keepTime = false } = {}) => {
      stage.show(robot, k);
      first = robot.scene.start + robot.scene.period; last = stage.last;
      bar.min = first; bar.max = last;
      state.wait = 0;
      seek(keepTime ? state.time : first);
      stage.home();
    };

    bar.addEventListener("input", () => { state.playing = false; seek(Number(bar.value)); });
    byId("play").addEventListener("click", toggle);
    byId("speed").addEventListener("change", (e) => { state.speed = Number(e.target.value); });
    byId("follow").addEventListener("change", (e) => { state.follow = e.target.checked; redraw(); });
    for (const id of ["trail", "tension"]) byId(id).addEventListener("change", redraw);
    // a click elsewhere closes the list of what is shown
    addEventListener("pointerdown", (e) => { if (!byId("show").contains(e.target)) byId("show").open = false; });
    const dress = (bright) => {
      document.documentElement.classList.toggle("light", bright);
      byId("shade").textContent = bright ? "Dark" : "Light"; redraw();
    };
    const bright = matchMedia("(prefers-color-scheme: light)");
    byId("shade").addEventListener("click", () => dress(!light()));
    bright.addEventListener("change", () => dress(bright.matches));
    dress(bright.matches);
    addEventListener("keydown", (e) => {
      const { activeElement } = document;
      if (e.ctrlKey || e.metaKey || e.altKey || ["INPUT", "SELECT", "BUTTON", "SUMMARY", "A"].includes(activeElement.tagName)) return;
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
    canvas.addEventListener("dblclick", () => { if (stage.shown) { stage.home(); redraw(); } });
    let size = "";
    new ResizeObserver(() => {
      const now = `${canvas.clientWidth} ${canvas.clientHeight}`;
      if (stage.shown && size !== now) stage.home();
      size = now;
      redraw();
    }).observe(canvas);
    const PAUSE = 1.2; // seconds that the end is shown before it begins again
    const tick = (now) => {
      const passed = before === null ? 0 : Math.min((now - before) / 1000, 0.25);
      if (state.playing && stage.shown && passed) {
        state.time += state.speed * passed;
        if (state.time >= last) {
          state.time = last;
          state.wait += passed;
          if (!loop) state.playing = false;
          else if (state.wait > PAUSE) { state.time = first; state.wait = 0; }
        }
        dirty = true;
      }
      before = now;
      if (dirty) { dirty = false; draw(); }
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
    return { show, toggle, redraw, state, stage, light };
  };

  return { decoded, inflated, motion, view, player };
})();

// A small drawing of a body: see body_drawing.py, which puts the drawings of the modules in.
window.taBody ||= (() => {
  const data = @data@;
  // faces: a figure from 1 to 8 for each module; head: index of the head module
  return (faces, head) => {
    const [dx, dy] = data.step, n = faces.length, margin = 60, c = data.colors;
    const thick = Math.max(1, n / 5); // long robots are drawn smaller
    const parts = [...faces].map((face, i) => {
      const m = data.modules[i % 2][face - 1];
      const line = (d, color, width) => `<path d="${d}" stroke="${color}" stroke-width="${width * thick}"/>`;
      return (
        `<g class="ta-module" transform="translate(${dx * i} ${dy * i})">` +
        line(m.cables, c.cable, 0.9) + line(m.rods, i === head ? c.head : c.rod, 3.6) +
        line(m.servo, c.servo, 3.6) + "</g>"
      );
    });
    const [w, h] = [(n - 1) * dx + 2 * margin, (n - 1) * Math.abs(dy) + 2 * margin];
    const top = Math.min((n - 1) * dy, 0) - margin;
    return (
      `<svg class="ta-body" viewBox="${-margin} ${top} ${w} ${h}" fill="none" stroke-linecap="round">` +
      `${parts.join("")}</svg>`
    );
  };
})();

// Charts of an equation: measured and predicted above, residuals below, along a coordinate that the reader chooses.
"use strict";
(() => {
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const MISSING = 65535;
  const FAR = 40; // standard deviations, beyond which the residual's scale is nearly logarithmic

  const decoded = (packed) => {
    if (packed === null || typeof packed === "number") return packed;
    const bytes = Uint8Array.from(atob(packed.data), (c) => c.charCodeAt(0));
    const whole = new DataView(bytes.buffer);
    return Array.from({ length: bytes.length / 2 }, (_, k) => {
      const at = whole.getUint16(2 * k, true);
      return at === MISSING ? null : packed.low + at * packed.step;
    });
  };

  const read = (element) => {
    const panel = JSON.parse(element.querySelector("script").textContent);
    for (const r of panel.recordings) {
      for (const name of ["measured", "before", "after", "deviation", "smooth_before", "smooth_after"]) r[name] = decoded(r[name]);
      r.along = r.along.map(decoded);
      const sd = (k) => (typeof r.deviation === "number" ? r.deviation : r.deviation[k]);
      const less = (residual) => r.measured && r.measured.map((v, k) => (residual[k] === null ? null : v - residual[k] * sd(k)));
      r.predicted = r.smooth_before ? [r.smooth_before, r.smooth_after] : [less(r.before), less(r.after)];
    }
    panel.means = panel.means.map((m) => [decoded(m.x), decoded(m.before), decoded(m.after)]);
    return panel;
  };

  // columns of the chosen recordings in the order of the coordinate
  const columns = (recordings, place) => {
    const rows = [];
    for (const r of recordings)
      r.along[place].forEach((x, k) => rows.push([x, r.measured && r.measured[k], r.predicted[0] && r.predicted[0][k],
        r.predicted[1] && r.predicted[1][k], r.before[k], r.after[k]]));
    rows.sort((a, b) => a[0] - b[0]);
    return [0, 1, 2, 3, 4, 5].map((n) => rows.map((row) => row[n]));
  };

  const axes = (along, what) => [along, what].map((label) => ({
    label, labelSize: 22, labelFont: "12px system-ui, sans-serif", font: "12px system-ui, sans-serif", size: 50,
    stroke: colour("--ink"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1 },
  })).map((axis, n) => (n ? { ...axis, size: 62 } : { ...axis, size: 34 }));

  const series = (label, stroke, lines, size) => ({
    label, stroke: colour(stroke), width: lines ? 1.2 : 0, paths: lines ? undefined : () => null,
    points: { show: !lines, size, fill: colour(stroke), width: 0 },
    value: (_, v) => (v === null || v === undefined ? "–" : Number(v.toPrecision(4)).toString()),
  });

  const band = (u) => { // where nineteen in twenty residuals of noise alone lie
    const [top, bottom] = [u.valToPos(2, "y", true), u.valToPos(-2, "y", true)];
    u.ctx.save();
    u.ctx.fillStyle = colour("--band");
    u.ctx.fillRect(u.bbox.left, top, u.bbox.width, bottom - top);
    u.ctx.restore();
  };

  const start = (element) => {
    const panel = read(element);
    const [recording, along] = element.querySelectorAll("select");
    const box = element.querySelector(".charts");
    let charts = [], whole = [0, 1];

    const draw = () => {
      charts.forEach((c) => c.destroy());
      const chosen = recording.value === "" ? panel.recordings : [panel.recordings[+recording.value]];
      const place = +along.value;
      const data = columns(chosen, place);
      whole = [data[0][0], data[0][data[0].length - 1]];
      const lines = panel.lines[place] && chosen.length === 1;
      const large = data[0].length < 300 ? 3 : 0; // few points are drawn larger
      const shared = (what, y, drawn, height) => ({
        width: box.clientWidth, height, scales: { x: { time: false }, y }, axes: axes(panel.along[place], what),
        cursor: { sync: { key: element.id }, drag: { x: true, y: false } }, legend: { markers: { width: 2, stroke: (u, k) => u.series[k].stroke(u, k) } }, ...drawn,
      });
      const far = Math.max(...data[4].map((v) => Math.abs(v || 0)));
      const residuals = {
        series: [{ label: panel.along[place] }, series("before", "--before", false, 4 + large), series("after", "--after", false, 3 + large)],
        hooks: { drawClear: [band] },
      };
      const y = far > FAR ? { distr: 4, asinh: 3 } : {};
      charts = [new uPlot(shared("residual (sd)", y, residuals, 220), [data[0], data[4], data[5]], box)];
      if (chosen.every((r) => r.measured)) {
        const signals = { series: [
          { label: panel.along[place] }, series("measured", "--ink", lines, 6 + large),
          series("predicted before", "--before", lines, 4 + large), series("predicted after", "--after", lines, 3 + large),
        ] };
        charts.unshift(new uPlot(shared(panel.quantity, {}, signals, 260), data.slice(0, 4), box));
        box.prepend(charts[0].root);
      }
      if (panel.means[place][0].length > 2) {
        const means = { series: [
          { label: panel.along[place] }, series("mean before", "--before", true, 4), series("mean after", "--after", true, 4),
        ] };
        charts.unshift(new uPlot(shared("mean residual (sd)", {}, means, 200), panel.means[place], box));
        box.prepend(charts[0].root);
      }
    };

    const scaled = (change) => {
      const { min, max } = charts[0].scales.x;
      const [a, b] = change(min, max);
      charts.forEach((c) => c.setScale("x", { min: Math.max(a, whole[0]), max: Math.min(b, whole[1]) }));
    };
    const moves = {
      in: (a, b) => [a + 0.25 * (b - a), b - 0.25 * (b - a)], out: (a, b) => [a - 0.5 * (b - a), b + 0.5 * (b - a)],
      left: (a, b) => { const s = Math.min(0.25 * (b - a), a - whole[0]); return [a - s, b - s]; },
      right: (a, b) => { const s = Math.min(0.25 * (b - a), whole[1] - b); return [a + s, b + s]; },
      reset: () => whole,
    };
    const keys = { "+": "in", "=": "in", "-": "out", ArrowLeft: "left", ArrowRight: "right", 0: "reset", Escape: "reset" };
    element.querySelectorAll("button").forEach((b) => b.addEventListener("click", () => scaled(moves[b.value])));
    box.addEventListener("keydown", (e) => {
      if (!(e.key in keys)) return;
      e.preventDefault();
      scaled(moves[keys[e.key]]);
    });
    [recording, along].forEach((s) => s.addEventListener("change", draw));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    let width = 0;
    const fit = () => {
      if (box.clientWidth === width) return;
      width = box.clientWidth;
      charts.length ? charts.forEach((c) => c.setSize({ width, height: c.height })) : draw();
    };
    new ResizeObserver(() => requestAnimationFrame(fit)).observe(box);
    element.querySelector(".controls").hidden = false;
  };

  document.querySelectorAll(".panel").forEach(start);
})();

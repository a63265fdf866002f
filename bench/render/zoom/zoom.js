// Draws the values that stand beside each static plot with uPlot, which zooms; the plots of one group show the same stretch of x.
"use strict";
// Fingers: two zoom about themselves, one moves what is zoomed, two taps show all. Up and down the page scrolls as ever.
function touchable(u) {
  const over = u.over, fingers = new Map();
  let start = null, tapped = 0;
  const all = () => [u.data[0][0], u.data[0][u.data[0].length - 1]];
  const show = (min, max) => {
    const [first, last] = all(), span = Math.min(max - min, last - first);
    const from = Math.min(Math.max(min, first), last - span);
    u.setScale("x", { min: from, max: from + span });
  };
  const begin = () => { start = { at: [...fingers.values()], min: u.scales.x.min, max: u.scales.x.max }; };
  const end = (e) => { if (fingers.delete(e.pointerId)) begin(); };
  over.style.touchAction = "pan-y";
  over.addEventListener("pointerdown", (e) => {
    if (e.pointerType !== "touch") return;
    fingers.set(e.pointerId, e.offsetX);
    begin();
    if (fingers.size === 1 && e.timeStamp - tapped < 300) show(...all());
    tapped = e.timeStamp;
  });
  over.addEventListener("pointermove", (e) => {
    if (!fingers.has(e.pointerId)) return;
    fingers.set(e.pointerId, e.offsetX);
    const now = [...fingers.values()], width = over.clientWidth, span = start.max - start.min;
    if (now.length === 1) show(start.min - (now[0] - start.at[0]) / width * span, start.max - (now[0] - start.at[0]) / width * span);
    if (now.length !== 2 || Math.abs(now[1] - now[0]) < 10) return;
    const [a, b] = start.at.map((px) => start.min + px / width * span), per_px = (b - a) / (now[1] - now[0]);
    if (per_px > 0) show(a - now[0] * per_px, a + (width - now[0]) * per_px);
  });
  for (const kind of ["pointerup", "pointercancel"]) over.addEventListener(kind, end);
}
function zoomable(group) {
  const css = getComputedStyle(document.documentElement);
  const colour = (name) => css.getPropertyValue("--" + name).trim();
  const split = (label) => { const at = label.lastIndexOf(", "); return at < 0 ? [label, ""] : [label.slice(0, at), label.slice(at + 2)]; };
  const plots = [];
  const axis = (label, size) => ({ label, size, stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line"), width: 1 } });
  // One plot's zoom is that of its group; a plot that is there already ends the round.
  const follow = (of, key) => {
    if (key !== "x") return;
    const { min, max } = of.scales.x;
    for (const { plot } of plots) if (plot !== of && (plot.scales.x.min !== min || plot.scales.x.max !== max)) plot.setScale("x", { min, max });
  };
  const draw = (figure) => {
    const svg = figure.querySelector("svg");
    const data = JSON.parse(figure.querySelector("script").textContent);
    const [name, unit] = split(data.x), [, yUnit] = split(data.y);
    const shown = (of) => (u, value) => value === null || value === undefined ? "–" : Number(value.toPrecision(5)) + " " + of;
    const width = figure.clientWidth;
    const options = {
      width, height: 260, scales: { x: { time: false } }, axes: [axis(data.x, 44), axis(data.y, 58)], hooks: { setScale: [follow] },
      cursor: { drag: { x: true, y: false } },
      series: [{ label: name, value: shown(unit) }, ...data.series.map((s) => ({
        label: s.label, stroke: colour("c" + s.colour), width: 1.5, dash: s.dashed ? [6, 4] : undefined, points: { show: false }, value: shown(yUnit) }))],
    };
    plots.push({ figure, plot: new uPlot(options, uPlot.join(data.series.map((s) => [s.x, s.y])), figure) });
    touchable(plots[plots.length - 1].plot);
    svg.setAttribute("hidden", "");
  };
  for (const figure of group.querySelectorAll("figure")) draw(figure);
  group.querySelector(".zoom-how").hidden = false;
  addEventListener("resize", () => { for (const { figure, plot } of plots) plot.setSize({ width: figure.clientWidth, height: 260 }); });
  group.plots = plots.map(({ plot }) => plot);
}
for (const group of document.querySelectorAll(".zoom")) zoomable(group);

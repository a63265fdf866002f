// Draws the values that stand beside each static plot with uPlot, which zooms; the plots of one group show the same stretch of x.
"use strict";
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
    svg.setAttribute("hidden", "");
  };
  for (const figure of group.querySelectorAll("figure")) draw(figure);
  group.querySelector(".zoom-how").hidden = false;
  addEventListener("resize", () => { for (const { figure, plot } of plots) plot.setSize({ width: figure.clientWidth, height: 260 }); });
  group.plots = plots.map(({ plot }) => plot);
}
for (const group of document.querySelectorAll(".zoom")) zoomable(group);

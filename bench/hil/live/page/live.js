// What all live pages share: the stream, curves over the last minute, and the stop, with the token of the address.
"use strict";
const KEPT_s = 60;
const COLOURS = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2"];
const token = location.hash.slice(1);
const state = document.getElementById("state");

function text(tag, content, className) {
  const element = document.createElement(tag);
  element.textContent = content;
  if (className) element.className = className;
  return element;
}

function number(value, digits) { return value === null || value === undefined ? "–" : value.toFixed(digits); }

// Curves over one time: plots are [name, title], each with the same series. `add(time, {name: [values of the series]})`.
class Curves {
  constructor(place, plots, labels) {
    this.place = place;
    this.times = [];
    this.values = Object.fromEntries(plots.map(([name]) => [name, labels(name).map(() => [])]));
    place.replaceChildren();
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const axis = { stroke: dark ? "#ccc" : "#333", grid: { stroke: "#8883" } };
    this.plots = plots.map(([name, title]) => {
      place.append(text("h2", title));
      const div = document.createElement("div");
      div.className = "plot";
      place.append(div);
      const options = { width: place.clientWidth, height: 200, scales: { x: { time: false } }, axes: [{ ...axis, label: "s", size: 28, labelSize: 18 }, { ...axis, size: 64 }],
        series: [{ label: "s" }, ...labels(name).map((label, i) => ({ label, stroke: COLOURS[i % COLOURS.length], width: 1.5 }))] };
      return { name, plot: new uPlot(options, [[]], div) };
    });
    addEventListener("resize", () => { for (const { plot } of this.plots) plot.setSize({ width: place.clientWidth, height: 200 }); });
  }
  add(time, values) {
    this.times.push(time);
    for (const name in this.values) this.values[name].forEach((kept, i) => kept.push(values[name][i] === undefined ? null : values[name][i]));
    while (this.times.length > 2 && this.times[0] < time - KEPT_s) {
      this.times.shift();
      for (const name in this.values) for (const kept of this.values[name]) kept.shift();
    }
    const shown = this.times.map((t) => t - time);
    for (const { name, plot } of this.plots) {
      plot.setData([shown, ...this.values[name]]);
      if (plot.cursor.idx === null || plot.cursor.left < 0) plot.setLegend({ idx: shown.length - 1 }, false);  // the newest, where no cursor asks for another
    }
  }
}

function connect(take) {
  const events = new EventSource("/events");
  events.onmessage = (event) => { const message = JSON.parse(event.data); state.textContent = message.state || "live"; state.className = ""; take(message); };
  events.onerror = () => { state.textContent = "no connection to the command: what is shown is old"; state.className = "lost"; };
  document.getElementById("stop").addEventListener("click", async () => {
    const answered = document.getElementById("answer");
    try {
      const answer = await fetch("/order", { method: "POST", headers: { "X-Token": token }, body: "stop" });
      answered.textContent = await answer.text();
      answered.className = answer.ok ? "" : "lost";
    } catch { answered.textContent = "the stop did not reach the command"; answered.className = "lost"; }
  });
}

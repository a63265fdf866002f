// Shows what the stream says: a table of ESCs and their curves over the last minute. Asks for nothing but the stop, with the token of the address.
"use strict";
const KEPT_s = 60;
const COLUMNS = [["esc_index", "index", 0], ["node", "node", 0], ["rpm", "rpm", 0], ["bus_V", "V", 2], ["bus_A", "A", 2], ["temperature_C", "°C", 1],
  ["power_percent", "%", 0], ["errors", "errors", 0]];
const COLOURS = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2"];
const PLOTS = [["rpm", "speed, rpm"], ["bus_A", "bus current, A"], ["temperature_C", "temperature, °C"]];
const token = location.hash.slice(1);
const state = document.getElementById("state");
let series = [], times = [], values = {}, plots = [], last = 0;

function text(tag, content, className) {
  const element = document.createElement(tag);
  element.textContent = content;
  if (className) element.className = className;
  return element;
}

function keyOf(esc) { return `ESC ${esc.esc_index}` + (esc.shares_index ? ` (node ${esc.node})` : ""); }

function drawTable(escs) {
  const body = document.querySelector("#escs tbody");
  body.replaceChildren(...escs.map((esc) => {
    const row = document.createElement("tr");
    for (const [name, , digits] of COLUMNS) row.append(text("td", esc[name] === null || esc[name] === undefined ? "–" : esc[name].toFixed(digits)));
    const silent = esc.age_ms > 3000;
    const words = silent ? `silent for ${Math.round(esc.age_ms / 1000)} s` : `${esc.mode || "?"}, ${esc.health || "?"}${esc.trouble ? ": " + esc.trouble : ""}` + (esc.shares_index ? "; index used twice" : "");
    row.append(text("td", words, silent || esc.shares_index || (esc.health && esc.health !== "ok") ? "bad" : "good"));
    return row;
  }));
  document.getElementById("none").hidden = escs.length > 0;
}

function makePlots() {
  const place = document.getElementById("plots");
  place.replaceChildren();
  plots = PLOTS.map(([name, title]) => {
    place.append(text("h2", title));
    const div = document.createElement("div");
    div.className = "plot";
    place.append(div);
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const axis = { stroke: dark ? "#ccc" : "#333", grid: { stroke: "#8883" } };
    const options = { width: place.clientWidth, height: 200, scales: { x: { time: false } }, axes: [{ ...axis, label: "s" }, { ...axis, size: 64 }],
      series: [{ label: "s" }, ...series.map((label, i) => ({ label, stroke: COLOURS[i % COLOURS.length], width: 1.5 }))] };
    return { name, plot: new uPlot(options, [[]], div) };
  });
}

function drawPlots() {
  const shown = times.map((t) => t - last);
  for (const { name, plot } of plots) plot.setData([shown, ...series.map((label) => values[name][label])]);
}

function take(message) {
  const now = message.time_s;
  const labels = message.escs.map(keyOf);
  if (labels.join() !== series.join()) {
    series = labels;
    times = [];
    values = Object.fromEntries(PLOTS.map(([name]) => [name, Object.fromEntries(labels.map((label) => [label, []]))]));
    makePlots();
  }
  last = now;
  times.push(now);
  message.escs.forEach((esc) => { for (const [name] of PLOTS) values[name][keyOf(esc)].push(esc.age_ms > 3000 ? null : esc[name]); });
  while (times.length > 2 && times[0] < now - KEPT_s) {
    times.shift();
    for (const [name] of PLOTS) for (const label of series) values[name][label].shift();
  }
  drawTable(message.escs);
  drawPlots();
}

document.querySelector("#escs thead tr").append(...COLUMNS.map(([, title]) => text("th", title)), text("th", "state"));
const events = new EventSource("/events");
events.onmessage = (event) => { state.textContent = "live"; state.className = ""; take(JSON.parse(event.data)); };
events.onerror = () => { state.textContent = "no connection to the command: what is shown is old"; state.className = "lost"; };
document.getElementById("stop").addEventListener("click", async () => {
  try {
    const answer = await fetch("/order", { method: "POST", headers: { "X-Token": token }, body: "stop" });
    state.textContent = await answer.text();
    state.className = answer.ok ? "" : "lost";
  } catch { state.textContent = "the stop did not reach the command"; state.className = "lost"; }
});
addEventListener("resize", () => { const width = document.getElementById("plots").clientWidth; for (const { plot } of plots) plot.setSize({ width, height: 200 }); });

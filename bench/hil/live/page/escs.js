// A table of ESCs and their curves.
"use strict";
// The last entry: left out where the window is narrow, so that the state needs no scrolling.
const COLUMNS = [["esc_index", "index", 0, ""], ["node", "node", 0, "minor"], ["rpm", "rpm", 0, ""], ["bus_V", "V", 2, ""], ["bus_A", "A", 2, ""],
  ["temperature_C", "°C", 1, ""], ["power_percent", "%", 0, "minor"], ["errors", "errors", 0, "minor"]];
const PLOTS = [["rpm", "speed, rpm"], ["bus_A", "bus current, A"], ["temperature_C", "temperature, °C"]];
let series = [], curves = null;

function keyOf(esc) { return `ESC ${esc.esc_index}` + (esc.shares_index ? ` (node ${esc.node})` : ""); }

function drawTable(escs) {
  const body = document.querySelector("#escs tbody");
  body.replaceChildren(...escs.map((esc) => {
    const row = document.createElement("tr");
    for (const [name, , digits, kind] of COLUMNS) row.append(text("td", number(esc[name], digits), kind));
    const silent = esc.age_ms > 3000;
    const words = silent ? `silent for ${Math.round(esc.age_ms / 1000)} s` : `${esc.mode || "?"}, ${esc.health || "?"}${esc.trouble ? ": " + esc.trouble : ""}` + (esc.shares_index ? "; index used twice" : "");
    row.append(text("td", words, silent || esc.shares_index || (esc.health && esc.health !== "ok") ? "bad" : "good"));
    return row;
  }));
  document.getElementById("none").hidden = escs.length > 0;
}

function take(message) {
  const labels = message.escs.map(keyOf);
  if (labels.join() !== series.join()) {
    series = labels;
    curves = new Curves(document.getElementById("plots"), PLOTS, () => series);
  }
  if (curves) curves.add(message.time_s, Object.fromEntries(PLOTS.map(([name]) => [name, message.escs.map((esc) => esc.age_ms > 3000 ? null : esc[name])])));
  drawTable(message.escs);
}

document.querySelector("#escs thead tr").append(...COLUMNS.map(([, title, , kind]) => text("th", title, kind)), text("th", "state"));
connect(take);

// A run on a stand: where it is in its plan, what is measured, how near each limit is, the steps that are done.
"use strict";
const RPM = 30 / Math.PI;
const NOW = [["omega_rad_s", "speed, RPM", 0, RPM], ["set_point_rad_s", "set-point, RPM", 0, RPM], ["thrust_N", "thrust, N", 3, 1], ["torque_N_m", "torque, N m", 4, 1],
  ["voltage_V", "supply, V", 2, 1], ["current_A", "supply, A", 2, 1], ["vibration_m_s2", "vibration, m/s²", 1, 1], ["motor_degC", "motor, °C", 1, 1]];
const PLOTS = [["speed", "speed, RPM"], ["thrust", "thrust, N"], ["torque", "torque, N m"], ["current", "supply current, A"]];
const LABELS = { speed: ["set-point", "ESC"], thrust: ["thrust"], torque: ["torque"], current: ["current"] };
let curves = null, newest_s = -1;

function row(cells) {
  const tr = document.createElement("tr");
  tr.append(...cells);
  return tr;
}

function figure(value) { return Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(3); }

function limitRow(limit) {
  const share = Math.min(1, Math.abs(limit.value) / limit.max), bar = document.createElement("td"), meter = document.createElement("progress");
  meter.max = 1;
  meter.value = share;
  if (share > 0.8) meter.className = "near";
  bar.append(meter);
  const known = limit.value !== null;
  return row([text("td", limit.name.replaceAll("_", " ") + (limit.source ? ` (${limit.source})` : "")), text("td", known ? figure(limit.value) : "–"), text("td", figure(limit.max)),
    known ? bar : text("td", limit.watched ? "" : "not watched", "bad"), text("td", limit.action.replace("_", " "))]);
}

function take(m) {
  if (!curves || m.t_s < newest_s) curves = new Curves(document.getElementById("plots"), PLOTS, (name) => LABELS[name]);
  newest_s = m.t_s;
  curves.add(m.t_s, { speed: [m.set_point_rad_s * RPM, m.omega_rad_s * RPM], thrust: [m.thrust_N], torque: [m.torque_N_m], current: [m.current_A] });
  document.getElementById("progress").value = m.planned_s > 0 ? Math.min(1, m.t_s / m.planned_s) : 0;
  document.getElementById("where").textContent = `part ${m.segment + 1} of ${m.segments}, ${m.t_s.toFixed(0)} s of about ${m.planned_s.toFixed(0)} s, ${m.steps.length} steps`;
  if (m.trip) { state.textContent = m.state + ": " + m.trip; state.className = "lost"; }
  document.getElementById("now").replaceChildren(...NOW.filter(([name]) => m[name] !== null).flatMap(([name, title, digits, factor]) => {
    const tile = document.createElement("div");
    tile.append(text("dt", title), text("dd", number(m[name] * factor, digits)));
    return [tile];
  }));
  document.querySelector("#limits tbody").replaceChildren(...m.limits.map(limitRow));
  document.querySelector("#steps tbody").replaceChildren(...m.steps.slice().reverse().map((s) => row([text("td", s.step + (s.configuration === "B" ? " B" : "")), text("td", number(s.omega_rad_s * RPM, 0)),
    text("td", number(s.thrust_N, 4)), text("td", number(s.torque_N_m, 5)), text("td", number(s.voltage_V, 2)), text("td", number(s.current_A, 2)), text("td", s.settled ? "" : "unsettled", "bad")])));
}

connect(take);

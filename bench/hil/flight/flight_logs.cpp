#include "bench/hil/flight/flight_logs.hpp"

#include <algorithm>
#include <string>

#include "bench/hil/flight/limiter_names.hpp"

namespace rotorloop::hil {
namespace {

log::Cells3 cells(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
log::Cells4 cells(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// Of the plant's motors, "7"; rotor by rotor, "7 6 7 7", where they differ.
std::string pole_pairs_text(const sim::PlantFile& plant) {
  std::string out = std::to_string(plant.rotors[0].motor.pole_pairs);
  const bool alike = std::all_of(plant.rotors.begin(), plant.rotors.end(),
                                 [&](const auto& r) { return r.motor.pole_pairs == plant.rotors[0].motor.pole_pairs; });
  for (std::size_t i = 1; !alike && i < plant.rotors.size(); ++i) out += " " + std::to_string(plant.rotors[i].motor.pole_pairs);
  return out;
}

}  // namespace

log::LogHeader log_header(const Scenario& scenario, const sim::PlantFile& plant, std::size_t flight, Variant variant, std::uint64_t seed) {
  return {{"start_utc", std::string(log::kVirtualEpochUtc)},
          {"source", "rotorloop hil, " + scenario.name},
          {"vehicle", scenario.vehicle.filename().generic_string()},
          {"flight", scenario.flights[flight].name},
          {"variant", variant_name(variant)},
          {"seed", std::to_string(seed)},
          {"pole_pairs", pole_pairs_text(plant)},
          {"control_limiter_bits", "1 tilt, 2 thrust, 4 roll_pitch, 8 yaw, 16 table_edge, 32 direction_held"},
          {"esc_limiter_codes", esc_limiter_codes()}};
}

unsigned limiter_bits(const host::Limiters& l) {
  return (l.tilt ? 1u : 0u) | (l.thrust ? 2u : 0u) | (l.roll_pitch ? 4u : 0u) | (l.yaw ? 8u : 0u) | (l.table_edge ? 16u : 0u) |
         (l.direction_held ? 32u : 0u);
}

log::FlightRow flight_row(const host::FlightRecord& r) {
  log::FlightRow row;
  row.t_s = static_cast<double>(r.time_us) * 1e-6;
  if (r.pose_new) {
    row.pose_t_s = static_cast<double>(r.pose.time_us) * 1e-6;
    row.p_W_m = cells(r.pose.p_W_m);
    row.q_WS = cells(r.pose.q_WS);
    row.v_W_m_s = cells(r.pose.v_W_m_s);
  }
  row.omega_rad_s = r.omega_rad_s;
  row.omega_cmd_rad_s = r.commanded_rad_s;
  row.i_q_A = r.current_A;
  row.bus_V = r.bus_V;
  row.bus_A = r.bus_A;
  row.gyro_B_rad_s = cells(r.imu.gyro_B_rad_s);
  row.accel_B_m_s2 = cells(r.imu.accel_B_m_s2);
  row.est_p_W_m = cells(r.estimate.p_W_m);
  row.est_v_W_m_s = cells(r.estimate.v_W_m_s);
  row.est_q_WB = cells(r.estimate.q_WB);
  row.sp_p_W_m = cells(r.setpoint.p_W_m);
  row.sp_v_W_m_s = cells(r.setpoint.v_W_m_s);
  row.sp_a_W_m_s2 = cells(r.setpoint.a_W_m_s2);
  row.sp_yaw_rad = r.setpoint.yaw_rad;
  row.thrust_cmd_N = r.command.diagnostics.thrust_B_N;
  row.torque_cmd_B_N_m = cells(r.command.diagnostics.torque_B_N_m);
  row.control_limiter = limiter_bits(r.command.diagnostics.limiters);
  return row;
}

log::TruthRow airframe_row(double t_s, const PlantTruth& t) {
  log::TruthRow row;
  row.t_s = t_s;
  row.p_W_m = cells(t.state.p_W_m);
  row.v_W_m_s = cells(t.state.v_W_m_s);
  row.q_WB = cells(t.state.q_WB);
  row.w_B_rad_s = cells(t.state.w_B_rad_s);
  row.omega_rad_s = t.omega_rad_s;
  row.thrust_N = t.thrust_N;
  row.shaft_torque_N_m = t.shaft_torque_N_m;
  return row;
}

log::TruthRow truth_row(double t_s, const PlantTruth& t, Loop& loop) {
  log::TruthRow row = airframe_row(t_s, t);
  for (std::size_t i = 0; i < 4; ++i) row.esc_limiter[i] = static_cast<double>(t.esc[i].limiter);
  row.bus_A = t.bus_A;
  if (const auto load = loop.esc_bus().load_by_window_percent(); !load.empty()) row.load_esc_percent = static_cast<double>(load.back());
  if (const auto load = loop.state_bus().load_by_window_percent(); !load.empty()) row.load_state_percent = static_cast<double>(load.back());
  return row;
}

FlightLogFiles::FlightLogFiles(const std::filesystem::path& folder, const log::LogHeader& header, Loop& loop) {
  if (folder.empty()) return;
  flight.emplace(folder / "flight.csv", header);
  truth.emplace(folder / "truth.csv", header);
  esc.emplace((folder / "esc.log").string(), "esc");
  state.emplace((folder / "state.log").string(), "state");
  loop.esc_bus().set_tap([this](const sim::BusEvent& e) {
    if (!e.error) esc->write(e.end_ns, e.frame);
  });
  loop.state_bus().set_tap([this](const sim::BusEvent& e) {
    if (!e.error) state->write(e.end_ns, e.frame);
  });
}

void FlightLogFiles::close(const std::filesystem::path& folder, RunFolder* run) {
  if (!flight) return;
  const std::string flight_hash = flight->close(), truth_hash = truth->close();
  esc->close();
  state->close();
  if (!run) return;
  run->note_log(folder / "flight.csv", flight_hash);
  run->note_log(folder / "truth.csv", truth_hash);
  run->note_log(folder / "esc.log");
  run->note_log(folder / "state.log");
}

}  // namespace rotorloop::hil

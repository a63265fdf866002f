// Which drive an ESC stands on, drawn from its random streams: native and emulated ESCs of one seed have the same motor and board.
#pragma once
#include <cstdint>
#include <numbers>

#include "sim/drive/typical.hpp"
#include "sim/esc/native_esc.hpp"

namespace rotorloop::sim {

inline constexpr std::uint64_t kNoiseStream = 0x45534E01, kBoardStream = 0x45534E02, kAngleStream = 0x45534E03, kTypicalStream = 0x45534E04;
inline constexpr double kSlow_rad_s = 20.0;  // below this the load coefficient torque/speed² means nothing

inline RandomStream esc_stream(const NativeEscConfig& c, std::uint64_t purpose) { return {c.seed, (c.module << 32) | purpose}; }

inline double initial_angle_rad(const NativeEscConfig& c) { return 2.0 * std::numbers::pi * esc_stream(c, kAngleStream).uniform(0); }

inline TypicalDrive drawn_drive(const NativeEscConfig& c, const BoardStage& stage) {
  if (c.typical_board) return typical_drive(c.drive, stage.most_phase_A, esc_stream(c, kTypicalStream));
  TypicalDrive t{c.drive};
  if (c.draw_board_spread) {
    const SensingParameters board = typical_board(esc_stream(c, kBoardStream));
    t.drive.sensing.gain = board.gain;
    t.drive.sensing.offset_counts = board.offset_counts;
  }
  return t;
}

inline DriveParameters with_clock(TypicalDrive t, bool own_clock) {
  if (own_clock) t.drive.inverter.pwm_Hz *= 1.0 + 1e-6 * t.clock_ppm;
  return t.drive;
}

// Torque of a propeller over its speed squared; a speed near zero counts as a slow one.
inline double load_coefficient_N_m_s2(double load_torque_N_m, double omega_rad_s) {
  const double w = omega_rad_s < 0.0 ? -omega_rad_s : omega_rad_s;
  const double floor_rad_s = w > kSlow_rad_s ? w : kSlow_rad_s;
  return load_torque_N_m / (floor_rad_s * floor_rad_s);
}

}  // namespace rotorloop::sim

// A complete ESC inside the simulator that runs the bytes of its program: an emulated STM32G431 on its board, the true drive behind its
// gates, its FDCAN on the virtual bus. Nothing of the firmware is compiled into it; it has the coupling interface of NativeEsc.
//
//   EmulatedEsc::step_together(escs, bus, until_ns);     the chips run to a time, and the bus with them to just before it
//   esc.couple(load_torque, bus_V);                      once per airframe step; then read omega, means
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "firmware/core/interface.hpp"
#include "sim/drive/drive.hpp"
#include "sim/esc/esc_program.hpp"
#include "sim/esc/native_esc.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::sim {

// What the chip did until now.
struct EmulatedCounters {
  std::uint64_t instructions = 0, resets = 0, both_gates = 0;
};

class EmulatedEsc {
 public:
  // `config`: as of a native ESC; its firmware parameters are stored in the flash before power-up, at the bus's start. own_clock: its
  // crystal, and the moment of power-up within a sample period. Attaches itself to the bus, which must not have run, as its next port.
  EmulatedEsc(const EscProgram& program, const NativeEscConfig& config, VirtualBus& bus, const std::string& name);
  ~EmulatedEsc();
  EmulatedEsc(EmulatedEsc&&) noexcept;

  // All chips go on to `until_ns` of the bus; the bus goes with them through all that happens before that, and stays open at it. Throws
  // Error (ExitCode::verdict) when a program does what the chip refuses.
  static void step_together(std::span<EmulatedEsc* const> escs, VirtualBus& bus, std::int64_t until_ns);
  // Without power the chip does nothing and all gates are low. Power back: it starts from its flash.
  void set_power(bool on);

  void couple(double load_torque_N_m, double bus_V);
  void couple_quadratic(double load_N_m_s2, double bus_V);
  double omega_rad_s() const;
  double shaft_acceleration_rad_s2() const;  // mean since the last couple()
  double bus_current_A() const;              // the same
  double bus_energy_J() const;               // taken from the bus since the start
  double pwm_phase() const;                  // turns of a sample period, against the common tick
  Drive& drive();
  const Drive& drive() const;
  firmware::Telemetry telemetry() const;
  EmulatedCounters counters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rotorloop::sim

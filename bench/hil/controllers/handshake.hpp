// The lockstep handshake with a controller in another process, line by line: one JSON object a line, our question, its answer.
// Both ends are written here, so that the process which runs a shared library speaks exactly what any other program does.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

#include "host/control/controller_abi.h"

namespace rotorloop::hil {

inline constexpr int kHandshakeVersion = 1;

// First question, with what the setup structure of the ABI holds.
struct HandshakeSetup {
  double period_s = 1e-3, mass_kg = 0, hover_omega_rad_s = 0, omega_min_rad_s = 0, omega_max_rad_s = 0;
  std::string vehicle_file, gains_file, flight, log_folder;
};
// First answer.
struct HandshakeHello {
  std::uint32_t level = 0;  // ROTORLOOP_LEVEL_…
  std::uint32_t every = 1;  // control steps, 1 to 100
  bool own_estimate = false;
  double start_s = 0.0;  // 0 to 120
};

// The C header's three numbers as a vector.
inline Eigen::Vector3d vector(const double (&a)[3]) { return {a[0], a[1], a[2]}; }

// An output as it is handed out: what has to be given is not a number.
rotorloop_controller_output empty_output();

std::string setup_line(const HandshakeSetup& s);
std::string hello_line(const HandshakeHello& h);
std::string input_line(const rotorloop_controller_input& in);
std::string output_line(std::uint64_t step, const rotorloop_controller_output& out);

// Each returns why the line cannot be taken; empty: it was. A number that is missing leaves what is there; null, NaN and Infinity
// are not-a-number.
std::string parse_setup(std::string_view line, HandshakeSetup& s);
std::string parse_hello(std::string_view line, HandshakeHello& h);
std::string parse_input(std::string_view line, rotorloop_controller_input& in);
std::string parse_output(std::string_view line, std::uint64_t step, rotorloop_controller_output& out);

}  // namespace rotorloop::hil

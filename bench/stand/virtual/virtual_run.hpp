// A whole run on the virtual stand, as `rotorloop stand run --virtual` makes it: the same folder as on ports, in virtual time.
#pragma once
#include <filesystem>
#include <string>

#include "bench/stand/run/run_on_stand.hpp"

namespace rotorloop::virtual_stand {

struct VirtualRunOptions {
  std::filesystem::path plant = "vehicles/reference_plant.toml";
  std::uint64_t seed = 1;     // of board, noise, and errors of the measuring chain
  double wind_m_s = 0.0;      // axial, through the rotor; goes into the run as its airspeed
  double strut = 0.08;        // share of the thrust that configuration B of abab loses
  bool perfect = false;       // a chain without errors
  int esc_pole_pairs = 0;     // that ESC and stand file are set to; 0: those of the stand file
  std::string dies;           // an instrument that falls silent …
  double dies_at_s = 0.0;     // … then
  double chipped_at_s = 0.0;  // from then on a blade lacks a piece; 0: never
};

// Throws Error as refuse_unsafe and find_esc do, and: device when the run does not end, as nothing reads an axis that it waits for.
stand_run::RunSummary run_virtually(const modbus::StandSetup& setup, const stand_run::Plan& plan, stand_run::RunOptions options,
                                    const VirtualRunOptions& virtual_options, const stand_run::RunObserver& observer = {});

}  // namespace rotorloop::virtual_stand

// The [esc] section of a plant file: power stage, how true it is, and what the ESCs were told of their motors.
#pragma once
#include <cstdint>
#include <vector>

#include "host/base/toml_file.hpp"
#include "sim/drive/boards.hpp"
#include "sim/drive/drive_fault.hpp"

namespace rotorloop::sim {

// What was written into the ESCs when the vehicle was built.
enum class EscKnowledge : std::uint8_t {
  motor_file,    // the motor file's values as they are
  data_sheet,    // with the tolerance of a data sheet: R, L, flux +-20 %, inertia +-30 %, drawn per seed, the same in all four
  commissioned,  // with what a commissioning leaves: R, L, flux +-5 %, inertia +-8 %, load +-10 %, per seed and ESC
  file,          // from a file of their own
};

struct EscFileValues {
  double resistance_ohm = 0.0, inductance_H = 0.0, flux_linkage_Wb = 0.0, inertia_kg_m2 = 0.0, load_N_m_s2 = 0.0;
  int pole_pairs = 0;
};

struct PlantEsc {
  bool given = false;  // the file has an [esc] section; without one the limits are those of the reference drive
  const BoardStage* stage = nullptr;
  bool typical = false;    // board = "typical": drawn boards on a shared supply; else "ideal"
  bool own_clock = false;  // clock = "own"
  EscKnowledge knowledge = EscKnowledge::motor_file;
  EscFileValues file;
  double phase_current_limit_A = 0.0;
};

// Absent: b_g431b_esc1, ideal, common clock, motor_file, 40 A. Throws Error with file, line, key, value, unit, range and remedy; so it
// does for a battery that the power stage cannot take.
PlantEsc read_plant_esc(const TomlTable& root, int cells);

// What breaks in one motor or its power stage, by the time since power-up (a flight begins at 2 s).
struct PlantDriveFault {
  int rotor = 1;  // 1 to 4
  DriveFault fault;
};

// The [[drive_fault]] tables. Throws Error with file, line, key, value, unit, range and remedy.
std::vector<PlantDriveFault> read_drive_faults(const TomlTable& root);

}  // namespace rotorloop::sim

// What the laboratory tries: motors of a class, or the motor, propeller, power stage and battery of a plant file.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/hil/esc_lab/motor_classes.hpp"
#include "sim/plant/plant_file.hpp"

namespace rotorloop::esc_lab {

struct Subject {
  std::string name;                                            // for people
  std::vector<std::pair<std::string, std::string>> facts;      // "battery" -> "4 cells"
  std::function<EscDraw(std::uint64_t seed, Knowledge)> draw;  // a board, and what the ESC was told of the motor; of a class a motor too
};

// Motor, board and supply drawn as motor_classes.hpp says.
Subject class_subject(const MotorClass& c);
// Rotor 1 of the plant as its files say; only board, supply (3.5 or 4.2 V per cell) and what the ESC was told are drawn. The class, which
// decides how long a start or a catch may take, follows from the propeller's diameter. Its drive faults are left out. Throws Error.
Subject plant_subject(const sim::PlantFile& plant);

}  // namespace rotorloop::esc_lab

// One PWM period with every edge: six FETs with their dead time, body diodes, capacitance of the switch nodes, a winding whose
// star point floats. Steps of at most 0.25 us unless said, ending at the edges. It knows nothing of the averaged law (commutation.hpp) and
// is the judge of it in tests; the drive itself uses it while a leg is broken, where no average exists.
#pragma once
#include <array>
#include <cstdint>

#include "sim/drive/drive_fault.hpp"
#include "sim/drive/inverter.hpp"

namespace rotorloop::sim {

// Which of the six FETs follow their compares: bit k the high side of phase k, bit 3 + k its low side.
inline constexpr std::uint8_t kNoGates = 0, kAllGates = 0x3F;

struct SwitchedStage {
  InverterParameters inverter{};
  double bus_V = 0.0;
  double avalanche_V = 60.0;         // of a FET without its diode's path
  double short_circuit_ohm = 20e-3;  // supply leads and two channels, when both FETs of a leg conduct
  LegFaults faults{};
  double longest_step_s = 0.25e-6;
};

struct SwitchedPeriod {
  std::array<double, 3> mean_node_V{};  // over the period
  Vector2 mean_v_V{};
  double bus_J = 0.0;
  double shorted_s = 0.0;                    // both FETs of a leg conducting
  std::array<double, 3> rise_A{}, fall_A{};  // phase currents where the gates are told to change sides
  std::array<double, 3> low_current_A{};     // through the low shunt at the end, the sampling instant; with what a shorted leg lets through
};

class SwitchedBridge {
 public:
  struct Gates {
    bool high = false, low = false;
  };

  // From one PWM centre (low sides on) to the next. duty of each high side 0..1; FETs that are not in `gates` stay off. m: the
  // motor without what is in series. The rotor turns as the equations say.
  SwitchedPeriod step_period(const SwitchedStage& stage, const MotorConstants<double>& m, MotorState& s, const std::array<double, 3>& duty,
                             std::uint8_t gates, const ShaftLoad& load);
  // Node voltages at rest; where they start when the bridge was off.
  std::array<double, 3> node_V{};

 private:
  void sub_step(const SwitchedStage& stage, const MotorConstants<double>& m, MotorState& s, const std::array<Gates, 3>& gate,
                const ShaftLoad& load, double dt_s, SwitchedPeriod& out);
};

}  // namespace rotorloop::sim

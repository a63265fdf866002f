// The shared supply of all ESCs: open-circuit voltage by state of charge, ohmic drop and one relaxation pair.
// V = OCV(SoC) - R0 I - V1,  C1 dV1/dt = I - V1/R1      (Chen & Rincon-Mora 2006, reduced to one pair)
#pragma once
#include <span>

namespace rotorloop::sim {

struct BatteryParameters {
  int cells = 4;
  double capacity_A_s = 1.5 * 3600.0;  // 1500 mA h
  double resistance_ohm = 0.030;       // pack, leads and connector
  double relaxation_ohm = 0.012;
  double relaxation_s = 1.5;
  double initial_charge = 0.90;  // 0..1
  bool can_sink = true;          // false: a bench supply that lets the bus rise instead
};

class Battery {
 public:
  explicit Battery(const BatteryParameters& parameters);
  // Sum of the ESCs' bus currents over dt; negative when they feed back. Returns the bus voltage for the next step.
  double step(double current_A, double dt_s);
  double step(std::span<const double> currents_A, double dt_s);
  double voltage_V() const { return bus_V_; }
  double rest_V() const { return p_.cells * open_circuit_cell_V(charge_) - relaxation_V_; }  // behind the resistance
  double charge() const { return charge_; }
  static double open_circuit_cell_V(double charge);

 private:
  BatteryParameters p_;
  double charge_;
  double relaxation_V_ = 0.0;
  double bus_V_;
};

}  // namespace rotorloop::sim

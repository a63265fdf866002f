#include "sim/plant/assemble.hpp"

namespace rotorloop::sim {

SharedRotors read_rotors(const PlantFile& plant) {
  SharedRotors rotors;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < i && !rotors[i]; ++j)
      if (plant.rotors[j].blade_path == plant.rotors[i].blade_path) rotors[i] = rotors[j];
    if (!rotors[i]) rotors[i] = std::make_shared<const Rotor>(read_blade(plant.rotors[i].blade_path));
  }
  return rotors;
}

Rotors pointers(const SharedRotors& rotors) { return {rotors[0].get(), rotors[1].get(), rotors[2].get(), rotors[3].get()}; }

AirframeConfig airframe_config(const PlantFile& plant, const Rotors& rotors, std::int64_t step_ns) {
  std::array<double, 4> blade_inertia_kg_m2{};
  for (std::size_t i = 0; i < 4; ++i) blade_inertia_kg_m2[i] = rotors[i]->blade_inertia_kg_m2();
  AirframeConfig c = airframe_config(plant, blade_inertia_kg_m2);
  c.step_ns = step_ns;
  return c;
}

DriveParameters drive_parameters(const PlantFile& plant, const Rotor& rotor, std::size_t esc) {
  const MotorFile& m = plant.rotors[esc].motor;
  DriveParameters d;
  d.motor = {.resistance_ohm = m.resistance_ohm,
             .inductance_H = {.d = m.inductance_d_H, .q = m.inductance_q_H},
             .flux_linkage_Wb = m.flux_linkage_Wb,
             .pole_pairs = m.pole_pairs,
             .inertia_kg_m2 = m.inertia_kg_m2,
             .static_friction_N_m = m.static_friction_N_m,
             .cogging_N_m = m.cogging_N_m};
  d.blade_inertia_kg_m2 = rotor.blade_inertia_kg_m2();
  for (const PlantDriveFault& f : plant.drive_faults)
    if (f.rotor == static_cast<int>(esc) + 1) d.faults.push_back(f.fault);
  if (plant.esc.stage) {
    d.inverter = plant.esc.stage->inverter;
    d.sensing = plant.esc.stage->sensing;
    d.thermal = plant.esc.stage->thermal;
  }
  return d;
}

BatteryParameters battery_parameters(const PlantFile& plant) {
  BatteryParameters b;
  b.cells = plant.battery.cells;
  b.capacity_A_s = plant.battery.capacity_Ah * 3600.0;
  b.resistance_ohm = plant.battery.resistance_ohm;
  b.initial_charge = plant.battery.state_of_charge;
  return b;
}

PlantSetup plant_setup(const PlantFile& plant, const Rotors& rotors, std::int64_t step_ns, std::uint64_t seed) {
  PlantSetup s;
  s.seed = seed;
  s.body = airframe_config(plant, rotors, step_ns);
  for (std::size_t i = 0; i < kAirframeRotors; ++i) s.drive[i] = drive_parameters(plant, *rotors[i], i);
  s.battery = battery_parameters(plant);
  s.imu = plant.imu;
  s.pose = plant.pose;
  return s;
}

}  // namespace rotorloop::sim

#include "bench/hil/plant_setup.hpp"

namespace rotorloop::bench {

SharedRotors read_rotors(const sim::PlantFile& plant) {
  SharedRotors rotors;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < i && !rotors[i]; ++j)
      if (plant.rotors[j].blade_path == plant.rotors[i].blade_path) rotors[i] = rotors[j];
    if (!rotors[i]) rotors[i] = std::make_shared<const sim::Rotor>(sim::read_blade(plant.rotors[i].blade_path));
  }
  return rotors;
}

std::array<const sim::Rotor*, 4> pointers(const SharedRotors& rotors) {
  return {rotors[0].get(), rotors[1].get(), rotors[2].get(), rotors[3].get()};
}

sim::AirframeConfig airframe_config(const sim::PlantFile& plant, const std::array<const sim::Rotor*, 4>& rotors, std::int64_t step_ns) {
  std::array<double, 4> blade_inertia_kg_m2{};
  for (std::size_t i = 0; i < 4; ++i) blade_inertia_kg_m2[i] = rotors[i]->blade_inertia_kg_m2();
  sim::AirframeConfig c = sim::airframe_config(plant, blade_inertia_kg_m2);
  c.step_ns = step_ns;
  return c;
}

sim::DriveParameters drive_parameters(const sim::PlantFile& plant, const sim::Rotor& rotor, int esc) {
  const sim::MotorFile& m = plant.rotors[static_cast<std::size_t>(esc)].motor;
  sim::DriveParameters d;
  d.motor = {.resistance_ohm = m.resistance_ohm,
             .inductance_H = {.d = m.inductance_d_H, .q = m.inductance_q_H},
             .flux_linkage_Wb = m.flux_linkage_Wb,
             .pole_pairs = m.pole_pairs,
             .inertia_kg_m2 = m.inertia_kg_m2,
             .static_friction_N_m = m.static_friction_N_m,
             .cogging_N_m = m.cogging_N_m};
  d.blade_inertia_kg_m2 = rotor.blade_inertia_kg_m2();
  return d;
}

sim::BatteryParameters battery_parameters(const sim::PlantFile& plant) {
  sim::BatteryParameters b;
  b.cells = plant.battery.cells;
  b.capacity_A_s = plant.battery.capacity_Ah * 3600.0;
  b.resistance_ohm = plant.battery.resistance_ohm;
  b.initial_charge = plant.battery.state_of_charge;
  return b;
}

sim::PoseConfig pose_config(const sim::PlantFile& plant, bool drift) {
  sim::PoseConfig p = plant.pose;
  p.drift_enabled = drift;
  return p;
}

firmware::Parameters firmware_parameters(const host::VehicleModel& vehicle) {
  firmware::Parameters p;
  p.inertia_kg_m2 = static_cast<float>(vehicle.rotor_inertia_kg_m2);
  p.load_N_m_s2 = static_cast<float>(vehicle.c_q_N_m_s2);
  return p;
}

}  // namespace rotorloop::bench

// Reads a plant file; checks single values by range and the file as a whole by what a body, a rotor set, a sensor can be.
#include "sim/plant/plant_file.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string_view>

#include "host/base/constants.hpp"

namespace rotorloop::sim {
namespace {

// ARCHITECTURE "Conventions": side of the hub and sense of rotation, rotor by rotor.
struct Place {
  std::string_view name;
  double x, y;
  int spin;
};
constexpr std::array<Place, kAirframeRotors> kPlaces{
    {{"front-right", 1, -1, 1}, {"rear-left", -1, 1, 1}, {"front-left", 1, 1, -1}, {"rear-right", -1, -1, -1}}};

Eigen::Vector3d vector3(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

PlantBody read_body(const TomlTable& t) {
  PlantBody b;
  b.mass_kg = t.number("mass_kg", {0.01, 100.0, "kg"});
  const auto i = t.numbers("inertia_kg_m2", 6, {-100.0, 100.0, "kg m^2"});
  b.inertia_kg_m2 << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  b.com_offset_m = vector3(t.numbers("com_offset_m", 3, {-0.5, 0.5, "m"}));
  const TomlTable drag = t.table("drag_area");
  b.drag_xy_N_s2_m2 = drag.number("xy_N_s2_m2", {0.0, 10.0, "N s^2/m^2"});
  b.drag_z_N_s2_m2 = drag.number("z_N_s2_m2", {0.0, 10.0, "N s^2/m^2"});

  const Eigen::Vector3d p = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(b.inertia_kg_m2).eigenvalues();
  if (!(p.minCoeff() > 0.0) || p.sum() < 2.0 * p.maxCoeff() * (1.0 - 1e-9))
    t.fail("inertia_kg_m2",
           fmt::format("body.inertia_kg_m2 has the principal moments {:.4g}, {:.4g}, {:.4g} kg m^2, which no body has", p[0], p[1], p[2]),
           "another order than xx yy zz xy xz yz, or a slipped digit",
           "each principal moment must be positive and at most the sum of the other two");
  // A body is not larger than 10 m and not smaller than 1 mm: catches g mm^2 and kg mm^2 read as kg m^2.
  constexpr double kMinGyration_m = 1e-3, kMaxGyration_m = 10.0;
  if (const double r = std::sqrt(p.maxCoeff() / b.mass_kg); r < kMinGyration_m || r > kMaxGyration_m)
    t.fail("inertia_kg_m2",
           fmt::format("body.inertia_kg_m2 with {} kg is a radius of gyration of {:.3g} m, credible is {} to {} m", b.mass_kg, r,
                       kMinGyration_m, kMaxGyration_m),
           "inertia or mass in another unit", "give kg m^2 and kg");
  return b;
}

// `sense`: 1, or -1 where all four rotors turn the other way ("props out").
PlantRotor read_rotor(const TomlTable& t, const Place& place, int sense, std::size_t number) {
  PlantRotor r;
  r.hub_m = vector3(t.numbers("position_m", 3, {-5.0, 5.0, "m"}));
  r.spin = static_cast<int>(t.integer("spin", -1, 1));
  const auto tilt = t.numbers("tilt_deg", 2, {-45.0, 45.0, "deg"});
  r.tilt_rad = {tilt[0] * kRad_per_deg, tilt[1] * kRad_per_deg};
  r.blade_path = t.file("blade");
  r.motor_path = t.file("motor");
  r.motor = read_motor(r.motor_path);
  if (r.hub_m.x() * place.x <= 0.0 || r.hub_m.y() * place.y <= 0.0)
    t.fail("position_m",
           fmt::format("rotor[{}].position_m = [{}, {}, {}] m is not {}", number, r.hub_m.x(), r.hub_m.y(), r.hub_m.z(), place.name),
           "another rotor order or another frame; here x is forward, y left",
           "order the rotors 1 front-right, 2 rear-left, 3 front-left, 4 rear-right");
  if (r.spin != sense * place.spin)
    t.fail("spin", fmt::format("rotor[{}].spin = {}, expected {} for {}", number, r.spin, sense * place.spin, place.name),
           "clockwise and counter-clockwise exchanged",
           "rotors 1 and 2 turn counter-clockwise seen from above (1), rotors 3 and 4 clockwise (-1), or all four the other way");
  return r;
}

PlantBattery read_battery(const TomlTable& t) {
  PlantBattery b;
  b.cells = static_cast<int>(t.integer("cells", 1, 14));
  b.capacity_Ah = t.number("capacity_Ah", {0.05, 100.0, "Ah"});
  b.state_of_charge = t.number("state_of_charge", {0.0, 1.0, "1"});
  b.resistance_ohm = t.number("resistance_ohm", {1e-4, 5.0, "ohm"});
  return b;
}

PoseConfig read_pose(const TomlTable& t) {
  PoseConfig p;
  p.rate_Hz = t.integer("rate_Hz", 1, 2000);
  p.latency_s = t.number("latency_s", {0.0, 1.0, "s"});
  p.jitter_s = t.number("jitter_s", {0.0, 1.0, "s"});
  p.noise_m = t.number("noise_m", {0.0, 10.0, "m"});
  p.noise_rad = t.number("noise_rad", {0.0, 0.5, "rad"});
  p.velocity_noise_m_s = t.number("velocity_noise_m_s", {0.0, 10.0, "m/s"});
  p.drift_m = t.number("drift_m", {0.0, 10.0, "m"});
  p.drift_tau_s = t.number("drift_tau_s", {0.01, 1e5, "s"});
  p.offset_B_m = vector3(t.numbers("offset_m", 3, {-1.0, 1.0, "m"}));
  const auto q = t.numbers("quaternion_wxyz", 4, {-1.0, 1.0, "1"});
  p.q_BS = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);

  constexpr double kNormTolerance = 1e-3;  // four decimals
  if (const double norm = p.q_BS.norm(); std::fabs(norm - 1.0) > kNormTolerance)
    t.fail("quaternion_wxyz", fmt::format("sensors.pose.quaternion_wxyz has the length {:.4f}, expected 1 within {}", norm, kNormTolerance),
           "rounded too far, or not in the order w, x, y, z", "normalise it: divide all four by their length");
  p.q_BS.normalize();
  if (p.jitter_s > p.latency_s)
    t.fail("jitter_s",
           fmt::format("sensors.pose.jitter_s = {} s is larger than latency_s = {} s: a pose would arrive before it was measured",
                       p.jitter_s, p.latency_s),
           "a slipped digit", "give jitter_s at most as large as latency_s");
  if (const double under_way = (p.latency_s + p.jitter_s) * static_cast<double>(p.rate_Hz);
      under_way > static_cast<double>(PoseSensor::kQueue - 2))
    t.fail("rate_Hz",
           fmt::format("sensors.pose.rate_Hz = {} Hz with a delay of up to {} s has {:.0f} readings under way, possible are {}", p.rate_Hz,
                       p.latency_s + p.jitter_s, under_way, PoseSensor::kQueue - 2),
           "", "lower rate_Hz or latency_s");
  return p;
}

ImuConfig read_imu(const TomlTable& t) {
  ImuConfig c;
  c.rate_Hz = t.integer("rate_Hz", 1, 2000);
  c.gyro_noise_rad_s = t.number("gyro_noise_rad_s", {0.0, 10.0, "rad/s"});
  c.accel_noise_m_s2 = t.number("accel_noise_m_s2", {0.0, 100.0, "m/s^2"});
  c.gyro_bias_rad_s = t.number("gyro_bias_rad_s", {0.0, 1.0, "rad/s"});
  c.accel_bias_m_s2 = t.number("accel_bias_m_s2", {0.0, 10.0, "m/s^2"});
  c.vibration = t.number("vibration", {0.0, 100.0, "1"});
  return c;
}

PlantEffect read_effect(const TomlTable& t) {
  PlantEffect e{t.text("id"), {}};
  const EffectInfo* effect = find_effect(e.id);
  if (!effect) t.fail("id", fmt::format("effect \"{}\" is not known", e.id), "a misspelt id", use_known_effect(e.id));
  const EffectParameter& p = effect->parameter;
  e.values = effect_values(*effect, 0.0);
  if (p.origin == ParameterOrigin::effect_entry) {
    e.values[0] = t.number(p.key, {p.min, p.max, p.unit});
  } else if (t.has(p.key)) {
    t.fail(p.key, fmt::format("effect \"{}\" takes {} from the rotor, not from this entry", e.id, p.key), "copied from a vehicle file",
           "remove it here; change inertia_kg_m2 of the motor file or blade_inertia_kg_m2 of the blade file");
  }
  for (std::size_t i = 0; i < effect->options.size(); ++i) {
    const EffectOption& o = effect->options[i];
    if (!t.has(o.key)) continue;
    e.values[i + 1] = o.integer ? static_cast<double>(t.integer(o.key, static_cast<std::int64_t>(o.min), static_cast<std::int64_t>(o.max)))
                                : t.number(o.key, {o.min, o.max, o.unit});
  }
  return e;
}

}  // namespace

PlantFile read_plant(const std::filesystem::path& path) { return read_plant(TomlFile::read(path)); }

PlantFile read_plant(const TomlFile& file) {
  (void)file.format({1});
  const TomlTable root = file.root();
  PlantFile plant;
  plant.path = file.path();
  plant.name = root.text("name");
  plant.body = read_body(root.table("body"));
  const auto rotors = root.tables("rotor", kAirframeRotors, kAirframeRotors);
  int sense = -1;
  for (std::size_t i = 0; i < kAirframeRotors; ++i) sense = rotors[i].integer("spin", -1, 1) == -kPlaces[i].spin ? sense : 1;
  for (std::size_t i = 0; i < kAirframeRotors; ++i) plant.rotors[i] = read_rotor(rotors[i], kPlaces[i], sense, i + 1);
  plant.battery = read_battery(root.table("battery"));
  plant.esc = read_plant_esc(root, plant.battery.cells);
  plant.drive_faults = read_drive_faults(root);
  plant.density_kg_m3 = root.table("air").number("density_kg_m3", {0.01, 5.0, "kg/m^3"});
  const TomlTable sensors = root.table("sensors");
  plant.pose = read_pose(sensors.table("pose"));
  plant.imu = read_imu(sensors.table("imu"));
  for (const TomlTable& t : root.tables("effect", 0, builtin_effects().size())) {
    PlantEffect e = read_effect(t);
    if (std::any_of(plant.effects.begin(), plant.effects.end(), [&](const PlantEffect& other) { return other.id == e.id; }))
      t.fail("id", fmt::format("effect \"{}\" is switched on twice", e.id), "a copied entry", "keep one entry for each effect");
    plant.effects.push_back(std::move(e));
  }
  file.refuse_unknown_keys();
  return plant;
}

AirframeConfig airframe_config(const PlantFile& plant, const std::array<double, kAirframeRotors>& blade_inertia_kg_m2) {
  AirframeConfig c;
  c.mass_kg = plant.body.mass_kg;
  c.inertia_kg_m2 = plant.body.inertia_kg_m2;
  c.com_offset_m = plant.body.com_offset_m;
  c.drag_xy_N_s2_m2 = plant.body.drag_xy_N_s2_m2;
  c.drag_z_N_s2_m2 = plant.body.drag_z_N_s2_m2;
  c.density_kg_m3 = plant.density_kg_m3;
  for (std::size_t i = 0; i < kAirframeRotors; ++i)
    c.rotors[i] = {plant.rotors[i].hub_m, plant.rotors[i].spin, plant.rotors[i].tilt_rad,
                   plant.rotors[i].motor.inertia_kg_m2 + blade_inertia_kg_m2[i]};
  return c;
}

EffectSet effect_set(const PlantFile& plant) {
  EffectSet set;
  for (const PlantEffect& e : plant.effects) set.add(e.id, e.values);
  return set;
}

}  // namespace rotorloop::sim

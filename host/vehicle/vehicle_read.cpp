#include <fmt/format.h>

#include <algorithm>

#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "host/base/toml_file.hpp"
#include "host/vehicle/vehicle_checks.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::host {

namespace {

// Ranges of small multirotors, 20 g to 20 kg: they catch slipped units, not bad vehicles.
constexpr Range kMass{0.02, 20.0, "kg"};
constexpr Range kInertia{1e-6, 2.0, "kg m²"};
constexpr Range kComOffset{-0.1, 0.1, "m"};
constexpr Range kPosition{-1.0, 1.0, "m"};
constexpr Range kK1{1e-10, 1e-2, "N s²"};
constexpr Range kK2{-1.0, 0.0, "N s²/m"};
constexpr Range kRadius{0.01, 0.5, "m"};
constexpr Range kDensity{0.5, 1.6, "kg/m³"};
constexpr Range kSpeed{0.0, 60000.0, "RPM"};
constexpr Range kCq{1e-12, 1e-3, "N m s²"};
constexpr Range kCq2{-1e-3, 1e-3, "N m s²"};
constexpr Range kAdvance{-1.0, 3.0, "1"};
constexpr Range kRotorInertia{0.0, 1e-2, "kg m²"};
constexpr Range kRotorDrag{0.0, 0.2, "s/m"};
constexpr Range kAirframeDrag{0.0, 1.0, "N s²/m²"};
constexpr Range kCeiling{0.2, 1000.0, "m"};
constexpr Range kCt{1e-12, 1e-2, "N s²"};
constexpr Range kAny{-1e9, 1e9, "the parameter's unit"};

Range uncertainty(const Range& of) { return {0.0, std::max(of.max, -of.min), of.unit}; }

Origin origin_in(const TomlTable& t) {
  const std::string word = t.choice("origin", {"cad", "stand", "flight", "guess"});
  for (const Origin o : {Origin::cad, Origin::stand, Origin::flight})
    if (name(o) == word) return o;
  return Origin::guess;
}

Quantity quantity(const TomlTable& parent, std::string_view key, const Range& range) {
  const TomlTable t = parent.table(key);
  return {t.number("value", range), t.number("u", uncertainty(range)), origin_in(t)};
}

template <std::size_t N>
std::array<double, N> fixed(const TomlTable& t, std::string_view key, const Range& range) {
  const std::vector<double> values = t.numbers(key, N, range);
  std::array<double, N> out{};
  std::copy(values.begin(), values.end(), out.begin());
  return out;
}

void read_body(const TomlTable& body, VehicleFile& v) {
  v.mass_kg = quantity(body, "mass_kg", kMass);
  const TomlTable inertia = body.table("inertia_kg_m2");
  v.inertia_kg_m2 = {quantity(inertia, "xx", kInertia), quantity(inertia, "yy", kInertia), quantity(inertia, "zz", kInertia)};
  const TomlTable com = body.table("com_offset_m");
  v.com_offset_m = {quantity(com, "x", kComOffset), quantity(com, "y", kComOffset)};
}

// Format 2: an older program would fly with the constant and say nothing.
void read_advance(const TomlTable& torque, int format, VehicleFile& v) {
  if (!torque.has("c_q2_N_m_s2")) return;
  if (format < 2) torque.fail("c_q2_N_m_s2", "c_q(J) in a file of format 1", "the key was added by hand", "set format = 2");
  v.advance = TorqueAdvanceFit{quantity(torque, "c_q2_N_m_s2", kCq2), fixed<2>(torque, "j_range", kAdvance)};
}

void read_models(const TomlTable& root, int format, VehicleFile& v) {
  const TomlTable thrust = root.table("thrust_model");
  v.k1_N_s2 = quantity(thrust, "k1_N_s2", kK1);
  v.k2_N_s2_m = quantity(thrust, "k2_N_s2_m", kK2);
  v.radius_m = thrust.number("radius_m", kRadius);
  v.air_density_kg_m3 = thrust.number("air_density_kg_m3", kDensity);
  v.rpm_window = fixed<2>(thrust, "rpm_window", kSpeed);
  const TomlTable torque = root.table("torque_model");
  v.c_q_N_m_s2 = quantity(torque, "c_q_N_m_s2", kCq);
  v.rotor_inertia_kg_m2 = quantity(torque, "rotor_inertia_kg_m2", kRotorInertia);
  read_advance(torque, format, v);
  const TomlTable drag = root.table("drag");
  v.c_dh_s_m = quantity(drag, "c_dh_s_m", kRotorDrag);
  v.c_dxy_N_s2_m2 = quantity(drag, "c_dxy_N_s2_m2", kAirframeDrag);
  v.c_dz_N_s2_m2 = quantity(drag, "c_dz_N_s2_m2", kAirframeDrag);
}

void read_pose_sensor(const TomlTable& t, PoseSensorPrior& p) {
  const TomlTable offset = t.table("offset_m");
  p.offset_m = fixed<3>(offset, "value", kPosition);
  p.offset_u_m = fixed<3>(offset, "u", uncertainty(kPosition));
  p.offset_origin = origin_in(offset);
  const TomlTable rotation = t.table("quaternion_wxyz");
  p.quaternion_wxyz = fixed<4>(rotation, "value", {-1.001, 1.001, "1"});
  p.rotation_u_rad = fixed<3>(rotation, "u_rad", {0.0, 3.2, "rad"});
  p.rotation_origin = origin_in(rotation);
}

VehicleEffect read_effect(const TomlTable& t, const EffectCatalogue& catalogue) {
  VehicleEffect e;
  e.id = t.text("id");
  const CatalogueEffect* row = catalogue.find(e.id);
  if (!row) {
    std::vector<std::string> ids;
    for (const CatalogueEffect& c : catalogue.effects) ids.push_back(c.id);
    t.fail("id", fmt::format("effect \"{}\" is not in the catalogue", e.id), "a misspelt id, or a file of a newer rotorloop",
           fmt::format("{}use one of: {}", did_you_mean(e.id, ids), fmt::join(ids, ", ")));
  }
  const TomlTable parameters = t.table("parameter");
  const std::vector<CatalogueParameter>& known = row->model;
  for (const std::string& key : parameters.keys()) {
    const auto declared = std::find_if(known.begin(), known.end(), [&](const CatalogueParameter& p) { return p.name == key; });
    if (!known.empty() && declared == known.end()) {
      std::string names;
      for (const CatalogueParameter& p : known) names += fmt::format("{}{}, in {}", names.empty() ? "" : "; ", p.name, p.unit);
      parameters.fail(key, fmt::format("effect \"{}\" has no parameter \"{}\"", e.id, key),
                      "a misspelt name, or the parameter of another effect",
                      fmt::format("its parameter{} {}", known.size() > 1 ? "s are" : " is", names));
    }
    e.parameters.push_back({key, quantity(parameters, key, known.empty() ? kAny : Range{declared->min, declared->max, declared->unit})});
  }
  if (const auto evidence = t.optional_table("evidence"))
    e.evidence = EffectEvidence{evidence->number("held_out_before", {0.0, 1e9, "the unit named beside it"}),
                                evidence->number("held_out_after", {0.0, 1e9, "the unit named beside it"}), evidence->text("unit"),
                                evidence->text("run", "")};
  return e;
}

VehicleFile read(const TomlFile& file, const EffectCatalogue& effects) {
  const int format = file.format({1, 2});
  const TomlTable root = file.root();
  VehicleFile v;
  v.name = root.text("name");
  read_body(root.table("body"), v);
  const std::vector<TomlTable> rotors = root.tables("rotor", kRotors, kRotors);
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    v.rotors[i].position_m = fixed<3>(rotors[i], "position_m", kPosition);
    v.rotors[i].reaction = static_cast<int>(rotors[i].integer("reaction", -1, 1));
  }
  read_models(root, format, v);
  read_pose_sensor(root.table("pose_sensor"), v.pose_sensor);
  if (const auto room = root.optional_table("room")) v.ceiling_z_m = room->number("ceiling_z_m", kCeiling);
  for (const TomlTable& t : root.tables("covariance", 0, 100)) v.covariance.push_back({t.texts("of"), t.numbers("matrix", 0, kAny)});
  for (const TomlTable& t : root.tables("static_thrust", 0, 20)) {
    const TomlTable c_t = t.table("c_t_N_s2");
    v.static_thrust.push_back({origin_in(t), c_t.number("value", kCt), c_t.number("u", uncertainty(kCt)), fixed<2>(t, "rpm_window", kSpeed),
                               t.number("air_density_kg_m3", kDensity)});
  }
  for (const TomlTable& t : root.tables("effect", 0, 100)) v.effects.push_back(read_effect(t, effects));
  if (const auto provenance = root.optional_table("provenance")) {
    v.written_by = provenance->text("written_by", "");
    if (provenance->has("inputs")) v.inputs = provenance->texts("inputs");
  }
  file.refuse_unknown_keys();
  check_vehicle(v, root);
  return v;
}

}  // namespace

std::string_view name(Origin origin) {
  switch (origin) {
    case Origin::cad:
      return "cad";
    case Origin::stand:
      return "stand";
    case Origin::flight:
      return "flight";
    case Origin::guess:
      return "guess";
  }
  return "guess";
}

VehicleFile read_vehicle(const std::filesystem::path& path, const EffectCatalogue& effects) { return read(TomlFile::read(path), effects); }

VehicleFile parse_vehicle(std::string_view text, const std::filesystem::path& name_for_errors, const EffectCatalogue& effects) {
  return read(TomlFile::parse(text, name_for_errors), effects);
}

const StaticThrust* VehicleFile::static_thrust_of(Origin origin) const {
  for (const StaticThrust& s : static_thrust)
    if (s.origin == origin) return &s;
  return nullptr;
}

VehicleModel to_model(const VehicleFile& v) {
  VehicleModel m;
  m.mass_kg = v.mass_kg.value;
  m.inertia_kg_m2 = {v.inertia_kg_m2[0].value, v.inertia_kg_m2[1].value, v.inertia_kg_m2[2].value};
  m.com_offset_m = {v.com_offset_m[0].value, v.com_offset_m[1].value, 0.0};
  for (std::size_t i = 0; i < v.rotors.size(); ++i)
    m.rotors[i] = {.position_m = Eigen::Vector3d(v.rotors[i].position_m.data()), .reaction = v.rotors[i].reaction};
  m.thrust = {v.k1_N_s2.value, v.k2_N_s2_m.value, v.radius_m, v.air_density_kg_m3};
  m.c_q_N_m_s2 = v.c_q_N_m_s2.value;
  if (v.advance) m.advance = {v.advance->c_q2_N_m_s2.value, v.advance->j_range[0], v.advance->j_range[1]};
  m.rotor_inertia_kg_m2 = v.rotor_inertia_kg_m2.value;
  m.drag = {v.c_dh_s_m.value, v.c_dxy_N_s2_m2.value, v.c_dz_N_s2_m2.value};
  if (v.ceiling_z_m) m.ceiling_z_m = *v.ceiling_z_m;
  m.pose_sensor_p_BS_m = Eigen::Vector3d(v.pose_sensor.offset_m.data());
  const auto& q = v.pose_sensor.quaternion_wxyz;
  m.pose_sensor_q_BS = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  return m;
}

}  // namespace rotorloop::host

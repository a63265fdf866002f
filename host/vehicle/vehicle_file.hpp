// vehicle.toml: the nominal model of a vehicle, each quantity with standard uncertainty and origin. Stand, identification and
// diagnosis write it; the controller, the mixer and comparisons read it. Hosts only; VehicleModel is what the loop uses.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/vehicle/effect_catalogue.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::host {

enum class Origin : std::uint8_t { cad, stand, flight, guess };
std::string_view name(Origin origin);

struct Quantity {
  double value = 0.0;
  double u = 0.0;  // standard uncertainty, same unit
  Origin origin = Origin::guess;
  friend bool operator==(const Quantity&, const Quantity&) = default;
};

struct PoseSensorPrior {
  std::array<double, 3> offset_m{}, offset_u_m{};  // from the centre of mass, B
  Origin offset_origin = Origin::guess;
  std::array<double, 4> quaternion_wxyz{1, 0, 0, 0};  // sensor to body; normalised by to_model()
  std::array<double, 3> rotation_u_rad{};
  Origin rotation_origin = Origin::guess;
  friend bool operator==(const PoseSensorPrior&, const PoseSensorPrior&) = default;
};

struct CovarianceBlock {
  std::vector<std::string> of;  // names as in quantity_names()
  std::vector<double> matrix;   // row-major, full
  friend bool operator==(const CovarianceBlock&, const CovarianceBlock&) = default;
};

// One finding about static thrust: what stand and flight say, side by side.
struct StaticThrust {
  Origin origin = Origin::stand;
  double c_t_N_s2 = 0.0, u_N_s2 = 0.0;
  std::array<double, 2> rpm_window{};
  double air_density_kg_m3 = 0.0;
  friend bool operator==(const StaticThrust&, const StaticThrust&) = default;
};

// How the torque coefficient goes with the advance ratio (AdvanceModel), from a stand in wind. Format 2.
struct TorqueAdvanceFit {
  Quantity c_q2_N_m_s2;
  std::array<double, 2> j_range{};
  friend bool operator==(const TorqueAdvanceFit&, const TorqueAdvanceFit&) = default;
};

struct EffectParameter {
  std::string name;
  Quantity quantity;
  friend bool operator==(const EffectParameter&, const EffectParameter&) = default;
};
struct EffectEvidence {
  double held_out_before = 0.0, held_out_after = 0.0;
  std::string unit, run;
  friend bool operator==(const EffectEvidence&, const EffectEvidence&) = default;
};
// A term that diagnosis added to the model.
struct VehicleEffect {
  std::string id;  // from effects/catalogue.toml
  std::vector<EffectParameter> parameters;
  std::optional<EffectEvidence> evidence;
  friend bool operator==(const VehicleEffect&, const VehicleEffect&) = default;
};

struct RotorPlace {
  std::array<double, 3> position_m{};  // hub, from the geometric centre
  int reaction = 1;
  friend bool operator==(const RotorPlace&, const RotorPlace&) = default;
};

struct VehicleFile {
  std::string name;
  Quantity mass_kg;
  std::array<Quantity, 3> inertia_kg_m2;  // xx yy zz
  std::array<Quantity, 2> com_offset_m;   // x y
  std::array<RotorPlace, kRotors> rotors;
  Quantity k1_N_s2, k2_N_s2_m;
  double radius_m = 0.0, air_density_kg_m3 = 0.0;
  std::array<double, 2> rpm_window{};
  Quantity c_q_N_m_s2, rotor_inertia_kg_m2;
  std::optional<TorqueAdvanceFit> advance;
  Quantity c_dh_s_m, c_dxy_N_s2_m2, c_dz_N_s2_m2;
  PoseSensorPrior pose_sensor;
  std::optional<double> ceiling_z_m;  // [room]: height of the ceiling in the logs' world, measured; none: open air, or not known
  std::vector<CovarianceBlock> covariance;
  std::vector<StaticThrust> static_thrust;
  std::vector<VehicleEffect> effects;
  std::string written_by;  // [provenance], may be empty
  std::vector<std::string> inputs;
  friend bool operator==(const VehicleFile&, const VehicleFile&) = default;

  const StaticThrust* static_thrust_of(Origin origin) const;  // nullptr when there is none
};

// Both throw Error (file, line, value, likely cause, remedy) for anything that cannot be a vehicle: see vehicle_checks.cpp.
VehicleFile read_vehicle(const std::filesystem::path& path, const EffectCatalogue& effects);
VehicleFile parse_vehicle(std::string_view text, const std::filesystem::path& name_for_errors, const EffectCatalogue& effects);

// Reads back to the same VehicleFile. `write_vehicle` replaces the file in one move, so no reader sees half of it.
std::string vehicle_text(const VehicleFile& vehicle);
void write_vehicle(const std::filesystem::path& path, const VehicleFile& vehicle);

VehicleModel to_model(const VehicleFile& vehicle);

// Standard uncertainty of a quantity by the name that covariance blocks use ("thrust_model.k1", "body.inertia.xx",
// "pose_sensor.rotation.z", "effect.ID.PARAMETER"); nothing for an unknown name.
std::optional<double> uncertainty_of(const VehicleFile& vehicle, std::string_view quantity_name);
std::optional<Origin> origin_of(const VehicleFile& vehicle, std::string_view quantity_name);  // the same names
std::vector<std::string> quantity_names();                                                    // those without effects

}  // namespace rotorloop::host

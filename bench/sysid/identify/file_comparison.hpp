// Comparison of the flights' values with other vehicle files: the paper's Table I against CAD and stand. Plain numbers; text, page and JSON
// are made of them elsewhere.
#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/sysid/identify/derived.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

// A line of the parameter table: an estimate, or what was held of the paper's θ, of added terms and of the pose sensor.
struct ParameterRow {
  int parameter = 0;
  std::string symbol;                          // "k_1", "Δx (vertical)"
  std::optional<estimate::Estimate> estimate;  // none: held
  double value = 0.0;
};
// In the order of Parameter; without poses those of the pose sensor are left out, for then they have no part in the fit.
std::vector<ParameterRow> parameter_rows(const Identification& result);

// What a file says of one number. `percent`: by how much the flights' value lies above it; `z`: the same in standard uncertainties of
// the difference. Not-a-number where that says nothing: of zero, of a rotation, without u.
struct FileValue {
  double value = 0.0, u = 0.0;
  host::Origin origin = host::Origin::guess;
  double percent = 0.0, z = 0.0;
};

struct ComparedVehicle {
  std::string label;  // name of the file
  host::VehicleFile file;
};
struct ComparisonColumn {
  std::string label;
  std::vector<std::optional<FileValue>> parameters;  // in the order of the rows; none: the file has no such quantity
  std::vector<FileValue> derived;                    // what follows from the file's values, in the order of the fit's; u is 0
  Eigen::Quaterniond q_BS = Eigen::Quaterniond::Identity();
};
// A [[static_thrust]] entry of a file, at the air density of the start file, against the static thrust of the fit.
struct ThrustComparison {
  std::string label;
  std::array<double, 2> rpm_window{};
  FileValue said;
};
struct FileComparison {
  std::vector<ParameterRow> rows;
  ComparisonColumn start;  // no z where the start was the prior
  std::vector<ComparisonColumn> others;
  std::vector<ThrustComparison> static_thrust;  // empty when neither k_1 nor k_2 was estimated: the fit then says nothing of it
};
// `derived`: of the fit, with `drag_speed_m_s`.
FileComparison compared(const Identification& result, const std::vector<DerivedQuantity>& derived, double drag_speed_m_s,
                        const ComparedVehicle& start, const std::vector<ComparedVehicle>& others);

// nullptr when there is none of this id.
const DerivedQuantity* derived_named(std::string_view id, const std::vector<DerivedQuantity>& derived);

// Of what the flights found; none where the rotation is another in each flight or no flight has poses.
std::optional<Eigen::Quaterniond> sensor_rotation(const Identification& result);

}  // namespace rotorloop::identify

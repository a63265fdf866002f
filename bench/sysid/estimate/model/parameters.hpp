// What can be estimated: the paper's θ, named extensions, and the parameters of added terms, in one flat list of numbers.
// Index = core parameter (enum below), or kCoreParameters + place in the model's TermList.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "host/effects/term.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::estimate {

enum Parameter : int {
  // dynamics
  kMass,
  kIxx,
  kIyy,
  kIzz,
  kIxy,
  kIxz,
  kIyz,
  kCq,
  kComX,
  kComY,
  kK1,
  kK2,
  kCdh,
  kCdxy,
  kCdz,
  kTiltX,
  kTiltY,  // gravity points along (tilt_x, tilt_y, -1) in the pose sensor's world
  // pose sensor: r_BS from the centre of mass; rotation vector of q_BS about its start value; stamps later than the moment shown
  kOffsetX,
  kOffsetY,
  kOffsetZ,
  kTurnX,
  kTurnY,
  kTurnZ,
  kPoseDelay,
  // inertial sensor: constant biases; place from the centre of mass
  kGyroBiasX,
  kGyroBiasY,
  kGyroBiasZ,
  kAccelBiasX,
  kAccelBiasY,
  kAccelBiasZ,
  kImuX,
  kImuY,
  kImuZ,
  // rotor speeds: stamps later than the moment measured; or, from commands u in 0..1 and battery voltage V:
  // ω_target = (offset + gain u) (V / V_reference)^exponent, reached with a first-order lag
  kRotorDelay,
  kCommandGain,
  kCommandOffset,
  kVoltageExponent,
  kCommandLag,
  kCoreParameters
};

struct ParameterInfo {
  std::string name;    // as in covariance blocks of a vehicle file where it has that quantity: "body.inertia.xx"
  std::string symbol;  // "I_xx", "translational_lift.share"
  std::string unit;
  double scale = 1.0;  // a change that matters; the fit works in these
  double min = 0.0, max = 0.0;
};

// Names under which terms know what a vehicle file calls torque_model.rotor_inertia; the first determines it best.
inline constexpr std::array<std::string_view, 2> kRotorInertiaNames{"effect.rotor_inertia_reaction.J_r_kg_m2",
                                                                    "effect.gyroscopic.J_r_kg_m2"};

ParameterInfo parameter_info(int parameter, const host::TermList& terms);
// Index of a parameter by name or symbol; -1 when there is none.
int find_parameter(std::string_view name_or_symbol, const host::TermList& terms);

// A model to fit: geometry and start values. The values are indexed as above.
struct ModelValues {
  host::LoadGeometry geometry;
  Eigen::Quaterniond start_q_BS = Eigen::Quaterniond::Identity();
  double reference_V = 0.0;  // of the voltage law; 0 when commands are not used
  host::TermList terms;
  std::vector<double> values;  // kCoreParameters + terms.parameters()

  double operator[](int parameter) const { return values[static_cast<std::size_t>(parameter)]; }
  double& operator[](int parameter) { return values[static_cast<std::size_t>(parameter)]; }
  Eigen::Quaterniond q_BS() const;  // start_q_BS turned by the three kTurn values
  Eigen::Matrix3d inertia_kg_m2() const;
};

// Terms start at their neutral values.
ModelValues model_values(const host::VehicleModel& vehicle, const host::TermList& terms = {});
// Back: everything that a VehicleModel holds; terms are left out.
host::VehicleModel vehicle_model(const ModelValues& values, const host::VehicleModel& base);

}  // namespace rotorloop::estimate

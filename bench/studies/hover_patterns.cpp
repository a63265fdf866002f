#include "bench/studies/hover_patterns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::studies {
namespace {

constexpr double kMostLoss = 0.5;  // of a rotor's thrust: with less left no vehicle of four rotors hovers

std::string anything(const Eigen::VectorXd&) { return {}; }
std::string positive_load(const Eigen::VectorXd& c) { return c(0) < 0.0 ? "a load below zero" : std::string(); }

// The first `count` unknowns are what rotors ask for more, having lost thrust.
auto losses(Eigen::Index count) {
  return [count](const Eigen::VectorXd& c) {
    for (Eigen::Index k = 0; k < count; ++k)
      if (c(k) < 0.0 || c(k) > kMostLoss / (1.0 - kMostLoss)) return fmt::format("a loss outside 0 to {:.0f} %", 100.0 * kMostLoss);
    return std::string();
  };
}

std::string within_reach(const Eigen::VectorXd& c) {
  if (c(0) <= 0.0) return "a load below zero";
  const double reach = std::max(std::abs(c(1)), std::abs(c(2))) / c(0);
  return reach > 2.0 ? fmt::format("the load would sit {:.1f} arms from the centre", reach) : std::string();
}

HoverPattern pattern_of(std::vector<std::string> ids, int rotor, std::vector<std::pair<std::string, std::string>> unknowns,
                        const std::vector<Eigen::Vector4d>& columns, std::function<std::string(const Eigen::VectorXd&)> outside) {
  Eigen::MatrixXd m(4, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) m.col(static_cast<Eigen::Index>(k)) = columns[k];
  return {std::move(ids), rotor, std::move(unknowns), std::move(m), std::move(outside)};
}

}  // namespace

std::string weak_rotor_id(int rotor) { return fmt::format("{} {}", host::effect("weak_rotor").id, rotor); }
std::string weak_motor_id(int rotor) { return fmt::format("{} {}", host::effect("motor_resistance").id, rotor); }
std::string load_at_rotor_id(int rotor) { return fmt::format("{} at rotor {}", host::effect("payload_mass").id, rotor); }
std::string blocked_wake_id(int rotor) { return fmt::format("{} {}", host::effect("blockage_strut").id, rotor); }

// In the reference hover every rotor carries its share, whatever its gain: a demand that rises by g asks for g of that share more. Balance
// of force, roll and pitch moment and yaw torque then gives:
//   load m at (x, y): m/M (1 + x X_i / X² + y Y_i / Y²): no change of yaw. Its place must be within two arms.
//   a rotor that gives less thrust and torque alike at a given command: its own demand only.
//   one that loses the two in other proportion: besides, all four change by the reaction's sign to balance yaw. One that keeps its torque
//   does exactly as a load at its hub of a quarter of the thrust lost.
std::vector<HoverPattern> hover_patterns(const host::VehicleModel& v) {
  using Eigen::Vector4d;
  Vector4d x, y, spin;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    x(k) = v.rotors[i].position_m.x();
    y(k) = v.rotors[i].position_m.y();
    spin(k) = v.rotors[i].reaction;
  }
  const Vector4d total = Vector4d::Ones(), pitch = x / std::sqrt(x.squaredNorm() / 4.0), roll = y / std::sqrt(y.squaredNorm() / 4.0);
  const std::string &payload = host::effect("payload_mass").id, &com = host::effect("com_offset").id,
                    &yaw = host::effect("body_torque_bias").id;
  std::vector<HoverPattern> out;
  out.push_back(pattern_of({payload}, 0, {{"load", "of the weight"}}, {total}, positive_load));
  out.push_back(pattern_of({yaw}, 0, {{"yaw", "of the demand"}}, {spin}, anything));
  for (int i = 0; i < 4; ++i) out.push_back(pattern_of({weak_rotor_id(i + 1)}, i + 1, {{"demand", "1"}}, {Vector4d::Unit(i)}, losses(1)));
  for (int i = 0; i < 4; ++i) {
    const Vector4d below = total + pitch * pitch(i) + roll * roll(i);
    out.push_back(pattern_of({load_at_rotor_id(i + 1)}, i + 1, {{"load", "of the weight"}}, {below}, positive_load));
  }
  out.push_back(pattern_of({com}, 0, {{"x", "of the arm"}, {"y", "of the arm"}}, {pitch, roll}, anything));
  out.push_back(pattern_of({payload, yaw}, 0, {{"load", "of the weight"}, {"yaw", "of the demand"}}, {total, spin}, positive_load));
  for (int i = 0; i < 4; ++i)
    out.push_back(
        pattern_of({weak_rotor_id(i + 1)}, i + 1, {{"demand", "1"}, {"yaw", "of the demand"}}, {Vector4d::Unit(i), spin}, losses(1)));
  for (int i = 0; i < 4; ++i)
    for (int k = i + 1; k < 4; ++k)
      out.push_back(pattern_of({weak_rotor_id(i + 1), weak_rotor_id(k + 1)}, 0, {{"demand", "1"}, {"demand", "1"}},
                               {Vector4d::Unit(i), Vector4d::Unit(k)}, losses(2)));
  out.push_back(pattern_of({payload, com}, 0, {{"load", "of the weight"}, {"x", "of the arm"}, {"y", "of the arm"}}, {total, pitch, roll},
                           within_reach));
  return out;
}

}  // namespace rotorloop::studies

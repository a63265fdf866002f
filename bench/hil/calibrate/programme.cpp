#include "bench/hil/calibrate/programme.hpp"

#include <cmath>

#include "host/base/constants.hpp"
#include "host/base/rotation_between.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::calibrate {
namespace {
// Scale of a balance and of the air's density that no repetition shows, common to all coefficients: 0.5 %. The virtual tunnel has
// neither error nor noise; without this a drag that the model has exactly would be written as known to 1e-19.
constexpr double kBalanceScale = 0.005;
}  // namespace

std::vector<FlightState> planned_states(const host::Trajectory& trajectory, double mass_kg, double period_s) {
  std::vector<FlightState> states;
  for (double t = 0.0; t < trajectory.duration_s(); t += period_s) {
    const host::Setpoint sp = trajectory.at(t);
    const Eigen::Vector3d thrust_W_N = mass_kg * (sp.a_W_m_s2 + Eigen::Vector3d(0.0, 0.0, kGravity_m_s2));
    const Eigen::Vector3d z_W = thrust_W_N.normalized();
    const Eigen::Quaterniond q_WB = rotation_between(Eigen::Vector3d::UnitZ(), z_W);
    states.push_back({q_WB.inverse() * sp.v_W_m_s, thrust_W_N.norm()});
  }
  return states;
}

host::VehicleFile calibrated(const host::VehicleFile& base, const LoadFit& fit, const std::string& written_by,
                             const std::vector<std::string>& inputs) {
  host::VehicleFile v = base;
  const auto stand = [](const FittedValue& f) {
    return host::Quantity{f.value, std::hypot(f.u, kBalanceScale * f.value), host::Origin::stand};
  };
  v.k1_N_s2 = stand(fit.k1_N_s2);
  v.k2_N_s2_m = stand(fit.k2_N_s2_m);
  v.c_q_N_m_s2 = stand(fit.c_q_N_m_s2);
  v.c_dh_s_m = stand(fit.c_dh_s_m);
  v.c_dxy_N_s2_m2 = stand(fit.c_dxy_N_s2_m2);
  v.c_dz_N_s2_m2 = stand(fit.c_dz_N_s2_m2);
  const double var1 = v.k1_N_s2.u * v.k1_N_s2.u, var2 = v.k2_N_s2_m.u * v.k2_N_s2_m.u;
  const double shared = fit.k1_k2_covariance + kBalanceScale * kBalanceScale * fit.k1_N_s2.value * fit.k2_N_s2_m.value;
  v.covariance = {{{"thrust_model.k1", "thrust_model.k2"}, {var1, shared, shared, var2}}};

  // Static thrust and its uncertainty by the gradient of c_t = k1 + k2 u, 2ρA u² - k2 u - k1 = 0.
  const host::ThrustModel model = host::to_model(v).thrust;
  const double q = model.momentum_kg_m(), s = std::sqrt(model.k2_N_s2_m * model.k2_N_s2_m + 4.0 * q * model.k1_N_s2);
  const double u = (model.k2_N_s2_m + s) / (2.0 * q), d1 = 2.0 * q * u / s, d2 = 2.0 * q * u * u / s;
  const double variance = d1 * d1 * var1 + 2.0 * d1 * d2 * shared + d2 * d2 * var2;
  v.static_thrust = {{host::Origin::stand, host::static_c_t(model), std::sqrt(std::max(variance, 0.0)), v.rpm_window, v.air_density_kg_m3}};
  v.written_by = written_by;
  v.inputs = inputs;
  return v;
}

host::VehicleFile calibrated(const host::VehicleFile& base, const FlownFit& fit, const std::string& written_by,
                             const std::vector<std::string>& inputs) {
  LoadFit loads;
  loads.k1_N_s2 = fit.k1_N_s2;
  loads.k2_N_s2_m = fit.k2_N_s2_m;
  loads.k1_k2_covariance = fit.k1_k2_covariance;
  loads.c_q_N_m_s2 = fit.c_q_N_m_s2;
  loads.c_dh_s_m = fit.c_dh_s_m;
  loads.c_dxy_N_s2_m2 = fit.c_dxy_N_s2_m2;
  loads.c_dz_N_s2_m2 = fit.c_dz_N_s2_m2;
  host::VehicleFile v = calibrated(base, loads, written_by, inputs);
  v.com_offset_m = {host::Quantity{fit.com_x_m.value, fit.com_x_m.u, host::Origin::stand},
                    host::Quantity{fit.com_y_m.value, fit.com_y_m.u, host::Origin::stand}};
  return v;
}

}  // namespace rotorloop::calibrate

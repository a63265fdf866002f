// What follows from the estimated parameters and is known better than they are: k1 and k2 alone are nearly unknown against each
// other, their static thrust is not. Uncertainties are propagated with the full covariance.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"

namespace rotorloop::identify {

struct DerivedQuantity {
  std::string id;      // of result.json: "static_c_t"
  std::string symbol;  // "c_t (static)"
  std::string meaning;
  std::string unit;
  double value = 0.0, u = 0.0, u_robust = 0.0;
};

// Loads are those of the whole model, its terms included. `drag_speed_m_s`: for the total drag, of flight with the rotors level and the
// thrust as heavy as the vehicle. Of the values of the first flight where parameters are per flight.
std::vector<DerivedQuantity> derived_quantities(const estimate::Fit& fit, const host::VehicleModel& base, double drag_speed_m_s);

// Any function of the values: its standard uncertainties by central differences over the estimates.
DerivedQuantity propagated(const estimate::Fit& fit, const std::function<double(const estimate::ModelValues&)>& function);

}  // namespace rotorloop::identify

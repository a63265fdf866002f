// The paper's stages (section IV-A): 1 vertical flight for thrust, 2 fast horizontal flight for drag, 3 rotation for inertia and
// torque; the centre of mass anew in each. Each stage frees its own parameters only. What it holds is uncertain, too: that
// uncertainty (of the vehicle file, then of earlier stages, with its covariance) is carried into the stage's own, which the
// published scheme leaves out (its k1, k2, c_dz are then wrong by 3 to 6 of their standard errors).
#pragma once
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/log/flight_set.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

using log::FlightRole;
std::string_view name(FlightRole role);

// The parameters that a stage frees, of those that the whole fit frees.
std::vector<int> stage_parameters(FlightRole role, const std::vector<estimate::FreeParameter>& all);

// What is known of the free parameters between stages.
struct Knowledge {
  std::vector<int> parameters;
  Eigen::MatrixXd covariance;
  std::vector<bool> estimated;  // by a stage
};
// Uncertainties of the vehicle file; a parameter without one may be off by its own size, or by the size that matters for it.
Knowledge first_knowledge(const std::vector<estimate::FreeParameter>& free, const host::VehicleFile& vehicle,
                          const estimate::ModelValues& values);

using Solver = std::function<estimate::Fit(const estimate::FitProblem&, const estimate::FitOptions&,
                                           const std::function<void(const estimate::FitProgress&)>&)>;
Solver own_solver();  // fit()

struct StageResult {
  FlightRole role = FlightRole::any;
  std::vector<std::size_t> flights;           // of all flights
  std::vector<estimate::Estimate> estimates;  // of the stage's parameters; u holds what was carried
  std::vector<double> u_alone;                // as if everything held were exact
  estimate::Fit fit;
};

// Runs one stage on `flights`; moves `values`, `known` and `noise` on. Of `priors` the weak ones of what the stage frees take part. Throws
// what the solver throws, with the stage's name before it.
StageResult run_stage(FlightRole role, const std::vector<const estimate::GridFlight*>& flights,
                      const std::vector<estimate::FreeParameter>& free, const std::vector<estimate::JointPrior>& priors,
                      estimate::ModelValues& values, Knowledge& known, estimate::NoiseModel& noise, const estimate::FitOptions& options,
                      const Solver& solver, const std::function<void(const estimate::FitProgress&)>& progress);

// A parameter as a stage and as the joint fit see it. Both used the stage's data; the difference of an efficient estimate and one that
// used less has the variance u_stage² - u_joint² (Hausman 1978). z is taken against u_stage: it says whether the
// stage's flight could have had the joint value, also where model error makes the joint fit the less certain one.
struct StageComparison {
  FlightRole role = FlightRole::any;
  int parameter = 0;
  double stage = 0.0, u_stage = 0.0, joint = 0.0, u_joint = 0.0, z = 0.0;
  bool agrees = true;  // |z| <= 3
};
std::vector<StageComparison> compare_stages(const std::vector<StageResult>& stages, const estimate::Fit& joint);

}  // namespace rotorloop::identify

// The vehicle file that a fit leaves behind: what it estimated replaces the nominal values, with uncertainty, covariance and
// origin `flight`; what it held stays as it was.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/identify/derived.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

// The uncertainty that is reported: the larger of the classical one and the one that holds for correlated residuals.
double reported_u(const estimate::Estimate& e);

// One estimate per parameter: as it is when shared; else the mean over the flights weighted by 1/u², its u that of the mean or the
// scatter of the flights about it, whichever is larger. `correlation` is that of the classical covariance, in the same order
// (a mean over flights counts as uncorrelated).
struct SharedEstimates {
  std::vector<estimate::Estimate> estimates;  // flight -1
  Eigen::MatrixXd correlation;
};
SharedEstimates shared_estimates(const estimate::Fit& fit);

// A vehicle file, and a line for each number in which it differs from the estimates that it is made of.
struct WrittenVehicle {
  host::VehicleFile file;
  std::vector<std::string> differences;
};

// `base`: the vehicle file the fit started from. `rpm_flown`: window of rotor speeds of the flights; {0, 0} keeps that of the file.
// What cannot be is not written: a drag coefficient below zero by no more than three standard uncertainties is 0, moments of inertia that
// no rigid body has by no more than that are moved to the nearest that one has, and what is correlated with them moves along; what lies
// farther off stays for the reader of the file to refuse. Uncertainties are the reported ones; covariance blocks have the correlations of
// the classical covariance. A parameter that its prior determines keeps its origin.
WrittenVehicle written_vehicle(const estimate::Fit& fit, const host::VehicleFile& base, const std::array<double, 2>& rpm_flown,
                               const std::string& written_by, const std::vector<std::string>& inputs);
host::VehicleFile identified_vehicle(const estimate::Fit& fit, const host::VehicleFile& base, const std::array<double, 2>& rpm_flown,
                                     const std::string& written_by, const std::vector<std::string>& inputs);

// Rotor speeds of the flights, RPM, from the lowest to the highest 0.1 %; {0, 0} when there are only commands.
std::array<double, 2> flown_rpm(const std::vector<estimate::GridFlight>& flights);

}  // namespace rotorloop::identify

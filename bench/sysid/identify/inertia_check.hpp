// Inertia and torque coefficients by bands of frequency, against those of the joint fit (decision 0115). A moment that the model lacks acts
// below the attitude loop's bandwidth, where a fit over all frequencies puts it into the inertia; above it the motors alone turn the
// vehicle.
#pragma once
#include <span>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/log/flight_record.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

struct InertiaByBand {
  int parameter = 0;  // kIxx or kIyy
  double value = 0.0, u = 0.0, explained = 0.0, delay_s = 0.0;
  double from_Hz = 0.0, to_Hz = 0.0;
  double joint = 0.0, u_joint = 0.0;  // of the fit over all frequencies; u_joint 0: it found none
  bool taken = false;                 // the band is surer than the joint fit, or contradicts it
};

struct InertiaCheck {
  std::vector<InertiaByBand> axes;  // those that the band determines
  bool needed = false;              // one was taken, or there is no fit that ended
  double mass_kg = 0.0;             // at which thrust carries the weight, and so the torque that the bands were found with
  const InertiaByBand* of(int parameter) const;
};

// With the values and states of a fit. `fit`: to compare with; null where there is none that ended.
InertiaCheck check_inertia(std::span<const log::FlightRecord* const> records, std::span<const estimate::GridFlight> flights,
                           std::span<const std::vector<estimate::BodyState>> states, std::span<const estimate::ModelValues> values,
                           const estimate::Fit* fit);

// Where needed, priors that outvote whatever the flights say over all frequencies: inertia of the band where it was taken, else that of the
// file; I_zz and c_q by the file, a guessed I_zz by the other two. About z every torque is a rotor's, so that flights determine ratios
// alone. Inertia of a band is held per mass: torque goes with thrust and thrust with the weight, and the missing moment would pull at a
// free mass instead.
std::vector<estimate::JointPrior> priors_of(const InertiaCheck& check, const host::VehicleFile& vehicle,
                                            std::span<const estimate::FreeParameter> free, const estimate::ModelValues& file_values);

// The same for a number that cannot be what the flights want: drag below zero, thrust that grows with climb, a figure of merit that no
// rotor has, each by more than three of its u (what is nearer is moved when the file is written). c_q then is the file's. `held`: gets the
// estimates.
std::vector<estimate::JointPrior> priors_of_the_possible(const estimate::Fit& fit, const host::VehicleFile& vehicle,
                                                         const estimate::ModelValues& file_values, std::vector<estimate::Estimate>& held);

}  // namespace rotorloop::identify

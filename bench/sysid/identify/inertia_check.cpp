#include "bench/sysid/identify/inertia_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "bench/sysid/score/inertia_band.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::identify {
namespace {

// Above the attitude loop of a small vehicle and of a large one; the one in which torque explains more of the acceleration counts.
constexpr std::array<std::array<double, 2>, 2> kBands_Hz{{{5.0, 15.0}, {8.0, 18.0}}};
constexpr double kSegment_s = 2.0;    // Hann windows
constexpr double kDetermined = 0.3;   // of a value: a band whose u is larger says nothing
constexpr double kExplains = 0.3;     // of the band's acceleration, at least
constexpr double kContradicts = 3.0;  // standard uncertainties
constexpr double kOfModel = 0.03;     // of an inertia: arms and slope of thrust are known no better
constexpr double kDecisive = 1e6;     // weight of a prior that outvotes the flights' own information
// I_zz over I_xx + I_yy of published small multirotors: 0.68, 0.89, 0.92, 0.92, 0.94 (IDSIA, cf2x, arpl, cf21B, NeuroBEM).
constexpr double kFlatness = 0.87, kFlatnessU = 0.1;
constexpr double kLeastMerit = 0.3, kLargestMerit = 0.85;  // what the reader of vehicle files takes for credible
constexpr double kBeyond = 3.0;                            // standard uncertainties; less is moved when the file is written
constexpr double kWithin = 0.01;                           // of its u: so far inside of what can be a number is held

double reported(const estimate::Estimate& e) { return std::max(e.u, e.u_robust); }

bool is_shared(std::span<const estimate::FreeParameter> free, int parameter) {
  return std::any_of(free.begin(), free.end(), [&](const estimate::FreeParameter& f) { return f.parameter == parameter && !f.per_flight; });
}

const Eigen::VectorXd kOne = Eigen::VectorXd::Ones(1);

// slope · parameters is `mean` with standard uncertainty u, whatever else is known.
estimate::JointPrior decisive(std::vector<int> parameters, const Eigen::VectorXd& slope, double mean, double u) {
  estimate::JointPrior p{std::move(parameters), slope * (mean / slope.squaredNorm()), slope * slope.transpose() / (u * u)};
  p.weight = kDecisive;
  return p;
}

estimate::JointPrior by_file(int parameter, const host::Quantity& said, const estimate::ModelValues& file) {
  return decisive({parameter}, kOne, file[parameter], said.u > 0.0 ? said.u : std::fabs(file[parameter]));
}

bool surer_or_against(double value, double u, double joint, double u_joint) {
  return !(u_joint > 0.0) || u < u_joint || std::fabs(value - joint) > kContradicts * std::hypot(u, u_joint);
}

// Noise of the torque makes the inertia too large by up to what it leaves unexplained.
InertiaByBand compared(int parameter, double from_Hz, double to_Hz, const score::BandInertia& band, const estimate::Fit* fit) {
  const double share = std::hypot(kOfModel, (1.0 - band.explained) / std::sqrt(12.0));
  InertiaByBand a{
      parameter, band.inertia_kg_m2, std::hypot(band.u_kg_m2, share * band.inertia_kg_m2), band.explained, band.delay_s, from_Hz, to_Hz};
  if (const estimate::Estimate* e = fit ? fit->find(parameter) : nullptr) {
    a.joint = e->value;
    a.u_joint = reported(*e);
  }
  a.taken = surer_or_against(a.value, a.u, a.joint, a.u_joint);
  return a;
}

}  // namespace

const InertiaByBand* InertiaCheck::of(int parameter) const {
  const auto found = std::find_if(axes.begin(), axes.end(), [&](const InertiaByBand& a) { return a.parameter == parameter; });
  return found == axes.end() ? nullptr : &*found;
}

InertiaCheck check_inertia(std::span<const log::FlightRecord* const> records, std::span<const estimate::GridFlight> flights,
                           std::span<const std::vector<estimate::BodyState>> states, std::span<const estimate::ModelValues> values,
                           const estimate::Fit* fit) {
  std::vector<score::BandSeries> pieces;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    for (score::BandSeries& p : score::band_series(*records[f], flights[f], states[f], values[f])) pieces.push_back(std::move(p));
  }
  InertiaCheck out;
  if (!values.empty()) out.mass_kg = values.front()[estimate::kMass];
  double best = 0.0;
  for (const auto& [from_Hz, to_Hz] : kBands_Hz) {
    std::vector<InertiaByBand> axes;
    double explained = 0.0;
    for (const int parameter : {estimate::kIxx, estimate::kIyy}) {
      const auto band = score::inertia_in_band(
          pieces, {.axis = parameter - estimate::kIxx, .from_Hz = from_Hz, .to_Hz = to_Hz, .delay_s = {}, .segment_s = kSegment_s});
      if (!band || band->segments < 2) continue;
      explained += band->explained;
      if (band->explained >= kExplains) axes.push_back(compared(parameter, from_Hz, to_Hz, *band, fit));
    }
    if (explained <= best) continue;
    best = explained;
    out.axes = std::move(axes);
  }
  std::erase_if(out.axes, [](const InertiaByBand& a) { return !(a.value > 0.0 && a.u < kDetermined * a.value); });
  out.needed = !fit || std::any_of(out.axes.begin(), out.axes.end(), [](const InertiaByBand& a) { return a.taken; });
  return out;
}

std::vector<estimate::JointPrior> priors_of(const InertiaCheck& check, const host::VehicleFile& vehicle,
                                            std::span<const estimate::FreeParameter> free, const estimate::ModelValues& file) {
  std::vector<estimate::JointPrior> out;
  if (!check.needed) return out;
  std::array<double, 2> inertia{file[estimate::kIxx], file[estimate::kIyy]};
  for (const int parameter : {estimate::kIxx, estimate::kIyy}) {
    const auto axis = static_cast<std::size_t>(parameter - estimate::kIxx);
    const InertiaByBand* band = check.of(parameter);
    if (band) inertia[axis] = band->taken ? band->value : band->joint;
    if (!is_shared(free, parameter) || (band && !band->taken)) continue;
    if (!band)
      out.push_back(by_file(parameter, vehicle.inertia_kg_m2[axis], file));
    else if (is_shared(free, estimate::kMass) && check.mass_kg > 0.0)
      out.push_back(decisive({estimate::kMass, parameter}, Eigen::Vector2d(-band->value / check.mass_kg, 1.0), 0.0, band->u));
    else
      out.push_back(decisive({parameter}, kOne, band->value, band->u));
  }
  if (is_shared(free, estimate::kIzz)) {
    const host::Quantity& said = vehicle.inertia_kg_m2[2];
    const double sum = inertia[0] + inertia[1];
    const bool tied =
        is_shared(free, estimate::kIxx) && is_shared(free, estimate::kIyy) && (said.origin == host::Origin::guess || !(said.u > 0.0));
    out.push_back(tied ? decisive({estimate::kIxx, estimate::kIyy, estimate::kIzz}, Eigen::Vector3d(-kFlatness, -kFlatness, 1.0), 0.0,
                                  kFlatnessU * sum)
                       : by_file(estimate::kIzz, said, file));
  }
  if (is_shared(free, estimate::kCq)) out.push_back(by_file(estimate::kCq, vehicle.c_q_N_m_s2, file));
  return out;
}

std::vector<estimate::JointPrior> priors_of_the_possible(const estimate::Fit& fit, const host::VehicleFile& vehicle,
                                                         const estimate::ModelValues& file, std::vector<estimate::Estimate>& held) {
  std::vector<estimate::JointPrior> out;
  for (int p = estimate::kCdh; p <= estimate::kCdz; ++p) {
    const estimate::Estimate* e = fit.find(p);
    if (!e || e->value >= -kBeyond * reported(*e)) continue;
    out.push_back(decisive({p}, kOne, kWithin * reported(*e), reported(*e)));
    held.push_back(*e);
  }
  if (const estimate::Estimate* e = fit.find(estimate::kK2); e && e->value > 0.0) {
    out.push_back(decisive({estimate::kK2}, kOne, -kWithin * reported(*e), reported(*e)));
    held.push_back(*e);
  }
  const estimate::Estimate* c_q = fit.find(estimate::kCq);
  if (!c_q) return out;
  const estimate::ModelValues& v = fit.values.front();
  const host::ThrustModel thrust{v[estimate::kK1], std::min(v[estimate::kK2], 0.0), v.geometry.radius_m, v.geometry.air_density_kg_m3};
  const double ideal = host::figure_of_merit(thrust, 1.0), u = kBeyond * reported(*c_q);  // the merit times c_q
  if (c_q->value >= ideal / kLargestMerit - u && c_q->value <= ideal / kLeastMerit + u) return out;
  out.push_back(by_file(estimate::kCq, vehicle.c_q_N_m_s2, file));
  held.push_back(*c_q);
  return out;
}

}  // namespace rotorloop::identify

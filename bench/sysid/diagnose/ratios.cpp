#include "bench/sysid/diagnose/ratios.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/render/digits.hpp"
#include "bench/sysid/estimate/model/parameters.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::array kScales{estimate::kMass, estimate::kIxx, estimate::kIyy, estimate::kIzz, estimate::kCq, estimate::kK1};
constexpr double kFirmer = 0.5;  // relative uncertainty of a ratio over that of the parameter

// Place among the estimates of a parameter that all flights share; -1 for none.
Eigen::Index shared(const estimate::Fit& fit, int parameter) {
  const estimate::Estimate* e = fit.find(parameter);
  return e && e->flight < 0 ? e - fit.estimates.data() : -1;
}

double value(const estimate::Fit& fit, Eigen::Index at) { return fit.estimates[static_cast<std::size_t>(at)].value; }

// Standard uncertainty relative to the size, by the larger of the classical and the block-robust covariance.
double relative_u(const estimate::Fit& fit, Eigen::Index of, Eigen::Index over) {
  double largest = 0.0;
  for (const Eigen::MatrixXd* c : {&fit.covariance, &fit.robust_covariance}) {
    const double a = value(fit, of);
    double square = (*c)(of, of) / (a * a);
    if (over >= 0) {
      const double b = value(fit, over);
      square += (*c)(over, over) / (b * b) - 2.0 * (*c)(of, over) / (a * b);
    }
    largest = std::max(largest, square);
  }
  return std::sqrt(largest);
}

}  // namespace

std::vector<NamedValue> well_determined_ratios(const estimate::Fit& fit, int parameter, const host::TermList& terms) {
  const Eigen::Index of = shared(fit, parameter);
  if (of < 0 || value(fit, of) == 0.0) return {};
  const double alone = relative_u(fit, of, -1);
  const estimate::ParameterInfo info = estimate::parameter_info(parameter, terms);
  const std::string own_name(parameter < estimate::kCoreParameters
                                 ? info.symbol
                                 : terms.parameter(static_cast<std::size_t>(parameter - estimate::kCoreParameters)).name);
  std::vector<NamedValue> out;
  for (const int scale : kScales) {
    const Eigen::Index over = shared(fit, scale);
    if (scale == parameter || over < 0 || value(fit, over) == 0.0) continue;
    const double relative = relative_u(fit, of, over);
    if (relative > kFirmer * alone) continue;
    const estimate::ParameterInfo by = estimate::parameter_info(scale, terms);
    const double ratio = value(fit, of) / value(fit, over);
    const std::string unit = info.unit == by.unit ? "1" : fmt::format("({})/({})", info.unit, by.unit);
    out.push_back({fmt::format("{} / {}", own_name, by.symbol), unit, ratio, relative * std::fabs(ratio)});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const NamedValue& a, const NamedValue& b) { return a.u * std::fabs(b.value) < b.u * std::fabs(a.value); });
  return out;
}

std::string ratios_text(const std::vector<NamedValue>& ratios) {
  std::string out;
  for (const NamedValue& r : ratios)
    out +=
        fmt::format("{}{} = {}{}", out.empty() ? "" : ", ", r.name, render::measured_text(r.value, r.u), r.unit == "1" ? "" : " " + r.unit);
  return out;
}

}  // namespace rotorloop::diagnose

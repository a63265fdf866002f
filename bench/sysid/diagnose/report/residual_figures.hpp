// The drawings of the residual sections, as figures with caption.
#pragma once
#include <string>

#include "bench/sysid/diagnose/residuals/residual_findings.hpp"

namespace rotorloop::diagnose {

std::string wrench_figures(const ResidualFindings& f, std::size_t flight);  // force and torque over time, beside each other
std::string spectrum_figure(const ResidualFindings& f, std::size_t axis);   // density, and that of noise of the fitted figures
std::string dependence_figure(const ResidualFindings& f, const Dependence& d);
std::string curve_figure(const ResidualFindings& f, std::size_t axis, const PartialCurve& c);
std::string lag_figure(const ResidualFindings& f, bool torque);
std::string step_figure(const ResidualFindings& f, const TimeStep& s);
std::string burst_figure(const ResidualFindings& f, std::size_t flight);
std::string place_figure(const PlaceMap& m);

}  // namespace rotorloop::diagnose

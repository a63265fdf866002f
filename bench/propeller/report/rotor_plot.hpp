// The page of one rotor: what the blade is, what it does in climb, edgewise flow and descent, and what happens on the disk. The
// solve's own answers, drawn; nothing here is measured, and the page says so.
#pragma once
#include <string>

#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {

struct RotorPlotRequest {
  std::string title;              // "triblade_5in"
  std::string source;             // the blade file as given
  std::string version;            // of the program
  sim::RotorCondition condition;  // of the disk maps; its speed and density hold for all curves. omega, density > 0
};

// Throws Error when the rotor is too slow for a meaningful inflow (InflowStatus::stopped): there is nothing to draw.
std::string rotor_plot_html(const sim::Blade& blade, const RotorPlotRequest& request);

}  // namespace rotorloop::propeller

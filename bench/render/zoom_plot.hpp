// Line plots that can be zoomed: the static drawing of svg_plot.hpp with its values beside it. Where scripts run, uPlot draws the values in
// place of the drawing; where none run, and in print, the drawing stays. Nothing is fetched.
#pragma once
#include <string>
#include <vector>

#include "bench/render/svg_plot.hpp"

namespace rotorloop::render {

// Plots of one x, which are zoomed together. Labels of axes are "name, unit": the unit follows each value under the cursor.
std::string zoom_figures_html(const std::vector<Plot>& plots);

// Once on a page, after all its figures.
std::string zoom_script_html();

}  // namespace rotorloop::render

// Drawings of the laboratory's page, a section for each battery that was run.
#pragma once
#include "bench/hil/esc_lab/lab.hpp"
#include "bench/render/document.hpp"

namespace rotorloop::esc_lab {

render::Sections figure_sections(const LabResult& result);

}  // namespace rotorloop::esc_lab

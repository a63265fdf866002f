// The study of effects as text: a page of Markdown (docs/effects.md is one) and a JSON document.
#pragma once
#include <string>
#include <vector>

#include "bench/hil/flight/effect_probe.hpp"
#include "bench/hil/flight/effect_study.hpp"

namespace rotorloop::hil {

struct EffectStudy {
  Scenario scenario;         // as flown
  std::string command_line;  // that repeats it
  std::vector<ProbeResult> probes;
  std::vector<EffectComparison> flights;
  std::string interrupted = {};  // by what signal; empty: complete
};

std::string effect_page(const EffectStudy& study);
std::string effect_json_text(const EffectStudy& study);  // pretty, ends with a newline

}  // namespace rotorloop::hil

// The added terms of one vehicle with the values of their parameters, at a fixed size so that the controller can carry them:
// what a vehicle file's [[effect]]s become, as VehicleModel is what the rest of the file becomes.
#pragma once
#include <algorithm>
#include <array>
#include <span>

#include "host/effects/term.hpp"

namespace rotorloop::host {

struct VehicleTerms {
  TermList list;
  std::array<double, kMaxTermParameters> values{};  // SI, in the order of the list's parameters

  bool empty() const { return list.size() == 0; }
  // Adds it with its memory, if it has one, at rest. False, and nothing added, when the list is full, has the term already, or the number
  // of values is not the term's.
  bool add(const Term& term, std::span<const double> parameters) {
    const std::size_t first = list.parameters();
    if (parameters.size() != term.info.parameters.size() || !list.add(term)) return false;
    std::copy(parameters.begin(), parameters.end(), values.begin() + static_cast<std::ptrdiff_t>(first));
    return true;
  }
};

}  // namespace rotorloop::host

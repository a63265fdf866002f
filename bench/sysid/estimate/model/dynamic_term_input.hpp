// The states of a model's dynamic terms over a flight (`memory` of a term): their filters (host/effects/memory.hpp) run along a motion that
// is known, with derivatives by the terms' own parameters and by their state at the start. The motion comes from a fit before this one, so
// the fit takes these states as it takes rotor speeds: as something known that depends on parameters.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bench/sysid/estimate/model/body_state.hpp"
#include "bench/sysid/estimate/model/parameters.hpp"
#include "bench/sysid/estimate/model/rotor_input_sample.hpp"
#include "host/effects/memory.hpp"

namespace rotorloop::estimate {

// States of a term that were measured instead: the place of a load on a string.
struct MeasuredTermState {
  std::string term;
  std::vector<std::array<double, host::kMaxTermMemory>> at_node;
};

// States at equal distances in time, all of them sound.
struct Motion {
  double start_s = 0.0, step_s = 0.0;
  std::vector<BodyState> states;
  std::vector<MeasuredTermState> measured;  // each as many as states

  double time_s(std::size_t k) const { return start_s + static_cast<double>(k) * step_s; }
};

// What drives the model at a time.
using InputAt = std::function<RotorInputSample(double t_s)>;

class DynamicTermInput {
 public:
  // Without a motion every memory is at rest.
  void follow(std::shared_ptr<const Motion> motion) { motion_ = std::move(motion); }
  bool follows() const { return motion_ != nullptr; }
  // Runs the filters with these values; `input_at` is prepared with the same and asked in the order of time. Their derivatives take as
  // many runs more as there are numbers.
  void prepare(const ModelValues& values, const InputAt& input_at, bool derivatives = true);
  // Puts the memory at time t, and where its derivatives stand, into `out`; held outside the motion.
  void at(double t_s, RotorInputSample& out) const;
  // visit(i, ∂memory_i / ∂parameter) for what depends on that parameter, at the moment of the sample.
  template <class Visit>
  void derivatives(std::size_t row, double share, int parameter, Visit&& visit) const {
    for (const Place& p : places_) {
      if (p.parameter != parameter) continue;
      const double* by = by_.data() + row * width_ + p.at;
      for (std::size_t k = 0; k < p.count; ++k) visit(p.first + k, by[k] + share * (by[width_ + k] - by[k]));
    }
  }

 private:
  std::shared_ptr<const Motion> motion_;
  std::size_t numbers_ = 0;  // of memory
  std::vector<double> series_;
  // Of each parameter of the terms and each start: where its derivatives stand in a row of by_, first memory number and how many.
  struct Place {
    int parameter = 0;
    std::size_t at = 0, first = 0, count = 0;
  };
  std::vector<Place> places_;
  std::vector<double> by_;
  std::size_t width_ = 0;
};

// The memory at both ends of a step; between them it runs straight.
struct TermStateEnds {
  MemoryNumbers from{}, to{};
};

// Carries the memory of all terms from one state to the next; u: inputs at both ends.
void advance_term_states(const ModelValues& values, const BodyState& from, const RotorInputSample& u_from, double from_s,
                         const BodyState& to, const RotorInputSample& u_to, double to_s, MemoryNumbers& memory);

}  // namespace rotorloop::estimate

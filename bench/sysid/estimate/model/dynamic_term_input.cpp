#include "bench/sysid/estimate/model/dynamic_term_input.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "bench/sysid/estimate/model/load_input.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::estimate {
namespace {

using host::LoadInput;
using host::LoadParameters;
using host::LoadState;

// The loads at one end of a step, with all that they refer to.
class Moment {
 public:
  Moment(const ModelValues& v, const BodyState& x, const RotorInputSample& u, double t_s, const MemoryNumbers& memory)
      : in_(input(x, u, t_s)), parameters_(load_parameters<double>(v)), state_{in_, parameters_, v.geometry, {}, {}, {}, {}, {}, {}, {}} {
    const host::TermSet<double> set(v.terms, v.values.data() + kCoreParameters, memory.data());
    host::loads(state_, &set);
  }
  Moment(const Moment&) = delete;
  Moment& operator=(const Moment&) = delete;
  const LoadState<double>& state() const { return state_; }

 private:
  static LoadInput<double> input(const BodyState& x, const RotorInputSample& u, double t_s) {
    const Eigen::Matrix3d world_B = x.q_WB.toRotationMatrix().transpose();
    return load_input<double>(x, world_B, world_B * x.v_W_m_s, u, t_s);
  }
  LoadInput<double> in_;
  LoadParameters<double> parameters_;
  LoadState<double> state_;
};

host::MemoryStep step_between(const Moment& a, const Moment& b, const BodyState& from, const BodyState& to, double dt_s) {
  const Eigen::Vector3d acceleration = (to.v_W_m_s - from.v_W_m_s) / dt_s, angular = (to.w_B_rad_s - from.w_B_rad_s) / dt_s;
  return {a.state(), b.state(), {acceleration.x(), acceleration.y(), acceleration.z()}, {angular.x(), angular.y(), angular.z()}, dt_s};
}

// One way the filter of a term is run beside its own: with a parameter or a start moved.
struct Branch {
  std::size_t term = 0, place = 0;
  double sign = 1.0, width = 0.0;  // width: between this branch and the one it is compared with
  std::array<double, host::kMaxMemoryParameters> parameters{};
  std::array<double, host::kMaxTermMemory> memory{};
};

std::vector<const MeasuredTermState*> measured_terms(const host::TermList& terms, const Motion& motion) {
  std::vector<const MeasuredTermState*> measured(terms.size(), nullptr);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    for (const MeasuredTermState& m : motion.measured) {
      if (m.term == terms.term(i).info.id && m.at_node.size() == motion.states.size()) measured[i] = &m;
    }
  }
  return measured;
}

// Two branches for each parameter and start of a dynamic term; one where the parameter stands at its bound.
// add_place(term, parameter): the place of their derivatives.
template <class AddPlace>
std::vector<Branch> branches_of(const ModelValues& v, const std::vector<const MeasuredTermState*>& measured, AddPlace&& add_place) {
  const host::TermList& terms = v.terms;
  const double* values = v.values.data() + kCoreParameters;
  std::vector<Branch> branches;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const host::TermInfo& info = terms.term(i).info;
    if (info.memory.empty() || measured[i]) continue;
    Branch own{.term = i};
    std::copy_n(values + terms.first_parameter(i), info.parameters.size(), own.parameters.begin());
    std::copy_n(values + terms.first_start(i), info.memory.size(), own.memory.begin());
    const auto pair = [&](std::size_t flat, double low, double high, auto&& number_of) {
      own.place = add_place(i, kCoreParameters + static_cast<int>(flat));
      for (const double sign : {1.0, -1.0}) {
        branches.push_back(own);
        branches.back().sign = sign;
        branches.back().width = high - low;
        number_of(branches.back()) = sign > 0.0 ? high : low;
      }
    };
    for (std::size_t k = 0; k < info.parameters.size(); ++k) {
      const host::TermParameter& p = info.parameters[k];
      const double at = own.parameters[k], e = 1e-3 * p.scale;
      pair(terms.first_parameter(i) + k, std::max(at - e, p.min), std::min(at + e, p.max),
           [k](Branch& b) -> double& { return b.parameters[k]; });
    }
    for (std::size_t k = 0; k < info.memory.size(); ++k) {
      if (info.memory[k].start_u <= 0.0) continue;
      const double at = own.memory[k], e = 1e-3 * info.memory[k].start_u;
      pair(terms.first_start(i) + k, at - e, at + e, [k](Branch& b) -> double& { return b.memory[k]; });
    }
  }
  return branches;
}

// Runs the filters and all their branches along the motion; write(node, memory) at each node.
template <class Write>
void run_filters(const ModelValues& v, const InputAt& input_at, const Motion& motion, const std::vector<const MeasuredTermState*>& measured,
                 std::vector<Branch>& branches, Write&& write) {
  const host::TermList& terms = v.terms;
  const double* values = v.values.data() + kCoreParameters;
  MemoryNumbers memory{};
  for (std::size_t i = 0; i < terms.size(); ++i) {
    for (std::size_t k = 0; k < terms.term(i).info.memory.size(); ++k) {
      const double start = values[terms.first_start(i) + k];
      memory[terms.first_memory(i) + k] = terms.term(i).info.memory[k].start_u > 0.0 ? start : 0.0;
    }
  }
  const auto write_with_measured = [&](std::size_t node) {
    for (std::size_t i = 0; i < terms.size(); ++i) {
      if (!measured[i]) continue;
      std::copy_n(measured[i]->at_node[node].begin(), terms.term(i).info.memory.size(),
                  memory.begin() + static_cast<std::ptrdiff_t>(terms.first_memory(i)));
    }
    write(node, memory);
  };
  write_with_measured(0);
  RotorInputSample u = input_at(motion.time_s(0));
  for (std::size_t k = 0; k + 1 < motion.states.size(); ++k) {
    const RotorInputSample next = input_at(motion.time_s(k + 1));
    const BodyState &from = motion.states[k], &to = motion.states[k + 1];
    const Moment a(v, from, u, motion.time_s(k), memory), b(v, to, next, motion.time_s(k + 1), memory);
    const host::MemoryStep step = step_between(a, b, from, to, motion.step_s);
    for (std::size_t i = 0; i < terms.size(); ++i) {
      if (terms.term(i).advance) terms.term(i).advance(values + terms.first_parameter(i), step, memory.data() + terms.first_memory(i));
    }
    for (Branch& branch : branches) terms.term(branch.term).advance(branch.parameters.data(), step, branch.memory.data());
    write_with_measured(k + 1);
    u = next;
  }
}

}  // namespace

void advance_term_states(const ModelValues& v, const BodyState& from, const RotorInputSample& u_from, double from_s, const BodyState& to,
                         const RotorInputSample& u_to, double to_s, MemoryNumbers& memory) {
  const Moment a(v, from, u_from, from_s, memory), b(v, to, u_to, to_s, memory);
  const host::MemoryStep step = step_between(a, b, from, to, to_s - from_s);
  for (std::size_t i = 0; i < v.terms.size(); ++i) {
    if (v.terms.term(i).advance)
      v.terms.term(i).advance(v.values.data() + kCoreParameters + v.terms.first_parameter(i), step,
                              memory.data() + v.terms.first_memory(i));
  }
}

void DynamicTermInput::prepare(const ModelValues& v, const InputAt& input_at, bool derivatives) {
  numbers_ = v.terms.memory();
  places_.clear();
  width_ = 0;
  if (numbers_ == 0 || !motion_ || motion_->states.size() < 2) {
    numbers_ = 0;
    return;
  }
  const std::vector<const MeasuredTermState*> measured = measured_terms(v.terms, *motion_);
  std::vector<Branch> branches;
  if (derivatives) {
    branches = branches_of(v, measured, [&](std::size_t term, int parameter) {
      const std::size_t count = v.terms.term(term).info.memory.size();
      places_.push_back({parameter, width_, v.terms.first_memory(term), count});
      width_ += count;
      return places_.size() - 1;
    });
  }
  series_.assign(motion_->states.size() * numbers_, 0.0);
  by_.assign(motion_->states.size() * width_, 0.0);
  run_filters(v, input_at, *motion_, measured, branches, [&](std::size_t node, const MemoryNumbers& memory) {
    std::copy_n(memory.begin(), numbers_, series_.begin() + static_cast<std::ptrdiff_t>(node * numbers_));
    double* row = by_.data() + node * width_;
    for (const Branch& b : branches) {
      const Place& p = places_[b.place];
      for (std::size_t k = 0; k < p.count; ++k) row[p.at + k] += b.width > 0.0 ? b.sign * b.memory[k] / b.width : 0.0;
    }
  });
}

void DynamicTermInput::at(double t_s, RotorInputSample& out) const {
  if (numbers_ == 0) return;
  const double last = static_cast<double>(motion_->states.size() - 1);
  const double place = std::clamp((t_s - motion_->start_s) / motion_->step_s, 0.0, last);
  const auto k = static_cast<std::size_t>(std::min(std::floor(place), last - 1.0));
  out.memory_share = place - static_cast<double>(k);
  const double* row = series_.data() + k * numbers_;
  for (std::size_t i = 0; i < numbers_; ++i) out.memory[i] = row[i] + out.memory_share * (row[numbers_ + i] - row[i]);
  out.dynamic_term_input = this;
  out.memory_row = k;
}

}  // namespace rotorloop::estimate

// Every term that a model may hold, one line each.
#include "host/effects/dynamic_inflow.hpp"
#include "host/effects/rotor_inertia_reaction.hpp"
#include "host/effects/rotor_local_inflow.hpp"
#include "host/effects/slung_load.hpp"
#include "host/effects/term.hpp"
#include "host/effects/thrust_lag.hpp"

namespace rotorloop::host {
namespace {

constexpr Term kTerms[] = {
    make_term<RotorLocalInflow>(),
    make_term<RotorInertiaReaction>(),
    make_term<ThrustLag>(),
    make_term<DynamicInflow>(),
    make_term<SlungLoad>(),
};

}  // namespace

std::span<const Term> all_terms() { return kTerms; }

const Term* find_term(std::string_view id) {
  for (const Term& t : kTerms) {
    if (t.info.id == id) return &t;
  }
  return nullptr;
}

bool TermList::add(const Term& term) {
  const std::size_t n = term.info.parameters.size(), m = term.info.memory.size();
  if (size_ == kMaxTerms || parameters_ + n > kMaxTermParameters || memory_ + m > kMaxMemory) return false;
  for (std::size_t i = 0; i < size_; ++i) {
    if (terms_[i]->info.id == term.info.id) return false;
  }
  terms_[size_] = &term;
  first_[size_] = parameters_;
  first_memory_[size_] = memory_;
  ++size_;
  parameters_ += n;
  memory_ += m;
  return true;
}

std::size_t TermList::term_of(std::size_t flat) const {
  std::size_t i = size_;
  while (i > 0 && first_[i - 1] > flat) --i;
  return i - 1;
}

std::size_t TermList::term_of_memory(std::size_t flat) const {
  for (std::size_t i = size_; i-- > 0;) {
    if (first_memory_[i] <= flat && !terms_[i]->info.memory.empty()) return i;
  }
  return 0;
}

const TermParameter& TermList::parameter(std::size_t flat) const {
  const std::size_t i = term_of(flat);
  return terms_[i]->info.parameters[flat - first_[i]];
}

}  // namespace rotorloop::host

// How a term joins the loads. A term is a struct with `kId`, `kParameters` and any of the hooks below, as static templates over the
// scalar; `c` points to its parameters in SI, in the order of kParameters; at their neutral values it must change nothing.
//   speeds(c, state)          sensor of rotor speed: state.omega_rad_s, state.omega_dot_rad_s2
//   air(c, state)             state.v_air_B_m_s: wind
//   inflow(c, state, i)       state.rotor[i].v_air_B_m_s, .arm_B_m, before the thrust is solved
//   rotor(c, state, i)        state.rotor[i].thrust_N, .torque_N_m, after it is solved
//   body(c, state)            state.force_B_N, state.torque_B_N_m, after everything else
//   reading(c, reading)       what sensors read beyond the truth
// Hooks of several terms run in the order in which the terms are listed in the model.
// A term whose load depends on the past names its `kMemory` and has `advance` (memory.hpp); its hooks find the numbers in state.memory.
#pragma once
#include <array>
#include <cstdint>
#include <iterator>
#include <span>
#include <string_view>

#include "host/effects/load_state.hpp"
#include "host/effects/memory.hpp"

namespace rotorloop::host {

struct TermParameter {
  std::string_view name, unit;
  double min = 0.0, max = 0.0;  // outside: not this effect
  double scale = 1.0;           // a change that matters, on the reference quadrotor (term_size.hpp); conditions the fit
  double neutral = 0.0;
};

// One number of a term's memory. Zero is rest: a term whose memory is zero acts as if it had always been in a steady state.
struct TermMemory {
  TermParameter start;  // its value when a flight begins; a number of that flight, not of the vehicle
  // How far from zero it may be then, as a standard deviation; 0: forgotten sooner than it matters, and taken as zero.
  double start_u = 0.0;
};

// What a fit, a diagnosis or a report has to know of a term beyond its hooks, so that none of them names a term. A term that has any of it
// says so in its `kTraits`.
struct TermTraits {
  bool mean_wind = false;             // its parameters are the velocity of the air, m/s: the mean of gusts looks like it
  bool mass_beside_body = false;      // its first parameter is a mass, kg, that the mass of the body does not contain
  bool memory_is_swing = false;       // its memory is the direction from the body to a load and the rate of it: a camera can measure it
  std::string_view common_part = {};  // rotor_groups.hpp
  // Whether what is known of the place where the vehicle flies lets the term act at all; nullptr: always. Else `unknown` says what is
  // missing, and `needs` where it is written.
  bool (*can_act)(const LoadGeometry&) = nullptr;
  std::string_view unknown = {}, needs = {};
};

struct TermInfo {
  std::string_view id;  // effects/catalogue.toml
  std::span<const TermParameter> parameters;
  std::span<const TermMemory> memory = {};
  // Rows of parameters at which to look for it first, where at neutral only the first parameter says something.
  std::span<const double> scan = {};
  TermTraits traits = {};
};

template <class S>
struct TermHooks {
  // The first argument is the term's `own`.
  void (*speeds)(const void*, const S*, LoadState<S>&) = nullptr;
  void (*air)(const void*, const S*, LoadState<S>&) = nullptr;
  void (*inflow)(const void*, const S*, LoadState<S>&, std::size_t) = nullptr;
  void (*rotor)(const void*, const S*, LoadState<S>&, std::size_t) = nullptr;
  void (*body)(const void*, const S*, LoadState<S>&) = nullptr;
  void (*reading)(const void*, const S*, ReadingState<S>&) = nullptr;
};

// A term of the list, for each scalar.
struct Term {
  TermInfo info;
  TermHooks<double> plain;
  TermHooks<PlaceDual> place;
  TermHooks<ExtraDual> extra;
  const void* own = nullptr;  // what its hooks need beside the parameters; a term written in C++ needs nothing
  Advance advance = nullptr;  // of a dynamic term

  template <class S>
  const TermHooks<S>& hooks() const;
};
template <>
inline const TermHooks<double>& Term::hooks<double>() const {
  return plain;
}
template <>
inline const TermHooks<PlaceDual>& Term::hooks<PlaceDual>() const {
  return place;
}
template <>
inline const TermHooks<ExtraDual>& Term::hooks<ExtraDual>() const {
  return extra;
}

// Whether what is known of the place lets the term act (TermTraits::can_act).
inline bool can_act(const Term& t, const LoadGeometry& g) { return !t.info.traits.can_act || t.info.traits.can_act(g); }

std::span<const Term> all_terms();
const Term* find_term(std::string_view id);  // nullptr when the list has none of that id

inline constexpr std::size_t kMaxTerms = 96, kMaxTermParameters = 192;

// The terms of a model, in order, and where the parameters of each begin in one flat list. Behind a term's own parameters stand the
// starts of its memory.
class TermList {
 public:
  // False when the list, or the memory of all terms, is full, or has the term already.
  bool add(const Term& term);
  std::size_t size() const { return size_; }
  std::size_t parameters() const { return parameters_; }
  const Term& term(std::size_t i) const { return *terms_[i]; }
  std::size_t first_parameter(std::size_t i) const { return first_[i]; }
  const TermParameter& parameter(std::size_t flat) const;  // and the term it belongs to:
  std::size_t term_of(std::size_t flat) const;
  // Where the memory of each term begins in one flat list, and how many numbers that list has.
  std::size_t memory() const { return memory_; }
  std::size_t first_memory(std::size_t i) const { return first_memory_[i]; }
  std::size_t first_start(std::size_t i) const { return first_[i] + terms_[i]->info.parameters.size(); }
  bool is_start(std::size_t flat) const;
  double start_u(std::size_t flat) const;  // of a start

 private:
  std::array<const Term*, kMaxTerms> terms_{};
  std::array<std::size_t, kMaxTerms> first_{}, first_memory_{};
  std::size_t size_ = 0, parameters_ = 0, memory_ = 0;
};

template <class S>
inline constexpr std::array<S, kMaxTermMemory> kAtRest{};

// A TermList with the values of its parameters, and of its memory when there is one: nullptr is rest.
template <class S>
class TermSet {
 public:
  TermSet(const TermList& list, const S* values, const S* memory = nullptr) : list_(list), values_(values), memory_(memory) {}
  // act(hooks, own, parameters, memory)
  template <class Act>
  void each(Act&& act) const {
    for (std::size_t i = 0; i < list_.size(); ++i) {
      const Term& t = list_.term(i);
      act(t.template hooks<S>(), t.own, values_ + list_.first_parameter(i), memory_ ? memory_ + list_.first_memory(i) : kAtRest<S>.data());
    }
  }

 private:
  const TermList& list_;
  const S *values_, *memory_;
};

// Fills the hooks of term T that exist.
template <class T, class S>
constexpr TermHooks<S> hooks_of() {
  TermHooks<S> h;
  if constexpr (requires(const S* c, LoadState<S>& s) { T::speeds(c, s); })
    h.speeds = [](const void*, const S* c, LoadState<S>& s) { T::speeds(c, s); };
  if constexpr (requires(const S* c, LoadState<S>& s) { T::air(c, s); })
    h.air = [](const void*, const S* c, LoadState<S>& s) { T::air(c, s); };
  if constexpr (requires(const S* c, LoadState<S>& s, std::size_t i) { T::inflow(c, s, i); })
    h.inflow = [](const void*, const S* c, LoadState<S>& s, std::size_t i) { T::inflow(c, s, i); };
  if constexpr (requires(const S* c, LoadState<S>& s, std::size_t i) { T::rotor(c, s, i); })
    h.rotor = [](const void*, const S* c, LoadState<S>& s, std::size_t i) { T::rotor(c, s, i); };
  if constexpr (requires(const S* c, LoadState<S>& s) { T::body(c, s); })
    h.body = [](const void*, const S* c, LoadState<S>& s) { T::body(c, s); };
  if constexpr (requires(const S* c, ReadingState<S>& r) { T::reading(c, r); })
    h.reading = [](const void*, const S* c, ReadingState<S>& r) { T::reading(c, r); };
  return h;
}
template <class T>
constexpr Term make_term() {
  Term t{{T::kId, T::kParameters}, hooks_of<T, double>(), hooks_of<T, PlaceDual>(), hooks_of<T, ExtraDual>()};
  if constexpr (requires { T::kTraits; }) t.info.traits = T::kTraits;
  if constexpr (requires { T::kMemory; }) {
    static_assert(std::size(T::kMemory) <= kMaxTermMemory && std::size(T::kParameters) <= kMaxMemoryParameters);
    t.info.memory = T::kMemory;
    t.advance = &T::advance;
    if constexpr (requires { T::kScan; }) t.info.scan = T::kScan;
  }
  return t;
}

}  // namespace rotorloop::host

// How a term joins the loads. A term is a struct with `kId`, `kParameters` and any of the hooks below, as static templates over the
// scalar; `c` points to its parameters in SI, in the order of kParameters; at their neutral values it must change nothing.
//   speeds(c, state)          sensor of rotor speed: state.omega_rad_s, state.omega_dot_rad_s2
//   air(c, state)             state.v_air_B_m_s: wind
//   inflow(c, state, i)       state.rotor[i].v_air_B_m_s, .arm_B_m, before the thrust is solved
//   rotor(c, state, i)        state.rotor[i].thrust_N, .torque_N_m, after it is solved
//   body(c, state)            state.force_B_N, state.torque_B_N_m, after everything else
//   reading(c, reading)       what sensors read beyond the truth
// Hooks of several terms run in the order in which the terms are listed in the model.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "host/effects/loads.hpp"

namespace rotorloop::host {

struct TermParameter {
  std::string_view name, unit;
  double min = 0.0, max = 0.0;  // outside: not this effect
  double scale = 1.0;           // a change that matters; conditions the fit
  double neutral = 0.0;
};

struct TermInfo {
  std::string_view id;  // docs/effects.toml
  std::span<const TermParameter> parameters;
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

std::span<const Term> all_terms();
const Term* find_term(std::string_view id);  // nullptr when the list has none of that id

inline constexpr std::size_t kMaxTerms = 96, kMaxTermParameters = 192;

// The terms of a model, in order, and where the parameters of each begin in one flat list.
class TermList {
 public:
  // False when the list is full or has the term already.
  bool add(const Term& term);
  std::size_t size() const { return size_; }
  std::size_t parameters() const { return parameters_; }
  const Term& term(std::size_t i) const { return *terms_[i]; }
  std::size_t first_parameter(std::size_t i) const { return first_[i]; }
  const TermParameter& parameter(std::size_t flat) const;  // and the term it belongs to:
  std::size_t term_of(std::size_t flat) const;

 private:
  std::array<const Term*, kMaxTerms> terms_{};
  std::array<std::size_t, kMaxTerms> first_{};
  std::size_t size_ = 0, parameters_ = 0;
};

// A TermList with the values of its parameters.
template <class S>
class TermSet {
 public:
  TermSet(const TermList& list, const S* values) : list_(list), values_(values) {}
  template <class Act>
  void each(Act&& act) const {
    for (std::size_t i = 0; i < list_.size(); ++i) {
      const Term& t = list_.term(i);
      act(t.template hooks<S>(), t.own, values_ + list_.first_parameter(i));
    }
  }

 private:
  const TermList& list_;
  const S* values_;
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
  return {{T::kId, T::kParameters}, hooks_of<T, double>(), hooks_of<T, PlaceDual>(), hooks_of<T, ExtraDual>()};
}

}  // namespace rotorloop::host

// The list of effects, and the few lines that let a set of them act.
#include "sim/effects/effect_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "sim/effects/builtin.hpp"

namespace rotorloop::sim {
namespace {

constexpr std::array<const Effect*, 4> kBuiltin{&kRotorBodyInterference, &kBlockageStrut, &kRotorInertiaReaction, &kGyroscopic};

auto rank(const Effect* e) { return std::find(kBuiltin.begin(), kBuiltin.end(), e); }

}  // namespace

std::span<const Effect* const> builtin_effects() { return kBuiltin; }

const Effect* find_effect(std::string_view id) {
  const auto it = std::find_if(kBuiltin.begin(), kBuiltin.end(), [&](const Effect* e) { return e->id == id; });
  return it == kBuiltin.end() ? nullptr : *it;
}

std::string known_effect_ids() {
  std::string ids;
  for (const Effect* e : kBuiltin) ids += (ids.empty() ? "" : ", ") + std::string(e->id);
  return ids;
}

void EffectSet::add(std::string_view id, double value) {
  static_assert(kBuiltin.size() <= kCapacity);
  const Effect* effect = find_effect(id);
  if (!effect)
    throw Error({"", fmt::format("effect \"{}\" is not known", id), "a misspelt id", fmt::format("use one of: {}", known_effect_ids())});
  if (has(id)) throw Error({"", fmt::format("effect \"{}\" is switched on twice", id), "a copied entry", "keep one entry for each effect"});
  const EffectParameter& p = effect->parameter;
  if (p.origin == ParameterOrigin::effect_entry && !(std::isfinite(value) && value >= p.min && value <= p.max))
    throw Error({"",
                 fmt::format("effect \"{}\": {} = {}{} is outside {} to {}", id, p.key, value,
                             p.unit == "1" ? "" : " " + std::string(p.unit), p.min, p.max),
                 "another unit than the key's name says", fmt::format("give {} within {} to {}", p.key, p.min, p.max)});
  active_[count_++] = {effect, value};
  std::sort(active_.begin(), active_.begin() + static_cast<std::ptrdiff_t>(count_),
            [](const Active& a, const Active& b) { return rank(a.effect) < rank(b.effect); });
}

bool EffectSet::has(std::string_view id) const {
  return std::any_of(active_.begin(), active_.begin() + static_cast<std::ptrdiff_t>(count_),
                     [&](const Active& a) { return a.effect->id == id; });
}

void EffectSet::apply(RotorLoads& loads) const {
  for (std::size_t i = 0; i < count_; ++i)
    if (active_[i].effect->on_rotor_loads) active_[i].effect->on_rotor_loads(active_[i].value, loads);
}

Eigen::Vector3d EffectSet::moment_B_N_m(const RotorMomentum& rotors, const Eigen::Vector3d& w_B_rad_s) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count_; ++i)
    if (active_[i].effect->moment_B_N_m) sum += active_[i].effect->moment_B_N_m(rotors, w_B_rad_s);
  return sum;
}

}  // namespace rotorloop::sim

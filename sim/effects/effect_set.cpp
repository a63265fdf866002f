// The list of effects, and the few lines that let a set of them act.
#include "sim/effects/effect_set.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "sim/effects/lists.hpp"

namespace rotorloop::sim {
namespace {

std::vector<const EffectInfo*> all_effects() {
  std::vector<const EffectInfo*> all;
  for (const EffectList list : {air_effects(), rotor_effects(), body_effects(), system_effects()})
    all.insert(all.end(), list.begin(), list.end());
  return all;
}

std::ptrdiff_t rank(const EffectInfo* e) {
  const auto all = builtin_effects();
  return std::find(all.begin(), all.end(), e) - all.begin();
}

std::string unit_text(std::string_view unit) { return unit == "1" ? "" : " " + std::string(unit); }

void check(std::string_view id, std::string_view key, std::string_view unit, double value, double min, double max) {
  if (!(std::isfinite(value) && value >= min && value <= max))
    throw Error({"", fmt::format("effect \"{}\": {} = {}{} is outside {} to {}", id, key, value, unit_text(unit), min, max),
                 "another unit than the key's name says", fmt::format("give {} within {} to {}", key, min, max)});
}

}  // namespace

std::span<const EffectInfo* const> builtin_effects() {
  static const std::vector<const EffectInfo*> all = all_effects();
  return all;
}

const EffectInfo* find_effect(std::string_view id) {
  for (const EffectInfo* e : builtin_effects())
    if (e->id == id) return e;
  for (const EffectInfo* e : foreign_effects())
    if (e->id == id) return e;
  return nullptr;
}

std::string use_known_effect(std::string_view id) {
  std::vector<std::string> ids;
  for (const EffectInfo* e : builtin_effects()) ids.emplace_back(e->id);
  return did_you_mean(id, ids) + fmt::format("use one of: {}", fmt::join(ids, ", "));
}

EffectValues effect_values(const EffectInfo& info, double value) {
  EffectValues v{};
  v[0] = value;
  for (std::size_t i = 0; i < info.options.size(); ++i) v[i + 1] = info.options[i].fallback;
  return v;
}

void EffectSet::add(std::string_view id, double value) {
  const EffectInfo* info = find_effect(id);
  add(id, info ? effect_values(*info, value) : EffectValues{});
}

void EffectSet::add(std::string_view id, const EffectValues& values) {
  const EffectInfo* info = find_effect(id);
  if (!info) throw Error({"", fmt::format("effect \"{}\" is not known", id), "a misspelt id", use_known_effect(id)});
  if (has(id)) throw Error({"", fmt::format("effect \"{}\" is switched on twice", id), "a copied entry", "keep one entry for each effect"});
  const EffectParameter& p = info->parameter;
  if (p.origin == ParameterOrigin::effect_entry) check(id, p.key, p.unit, values[0], p.min, p.max);
  for (std::size_t i = 0; i < info->options.size(); ++i) {
    const EffectOption& o = info->options[i];
    check(id, o.key, o.unit, values[i + 1], o.min, o.max);
    if (o.integer && values[i + 1] != std::floor(values[i + 1]))
      throw Error({"", fmt::format("effect \"{}\": {} = {} is not a whole number", id, o.key, values[i + 1]), "", "give a whole number"});
  }
  Active entry{info, info->make(values)};
  const auto after = std::find_if(active_.begin(), active_.end(), [&](const Active& a) { return rank(a.info) > rank(info); });
  active_.insert(after, std::move(entry));
}

bool EffectSet::has(std::string_view id) const {
  return std::any_of(active_.begin(), active_.end(), [&](const Active& a) { return a.info->id == id; });
}

void EffectSet::prepare(PlantSetup& setup) {
  for (const Active& a : active_) a.effect->prepare(setup);
}
void EffectSet::air(const Eigen::Vector3d& p_W_m, double time_s, Air& air) const {
  for (const Active& a : active_) a.effect->air(p_W_m, time_s, air);
}
void EffectSet::rotor_condition(const RotorSite& site, RotorCondition& condition) const {
  for (const Active& a : active_) a.effect->rotor_condition(site, condition);
}
void EffectSet::rotor_loads(const RotorSite& site, RotorLoads& loads) {
  for (const Active& a : active_) a.effect->rotor_loads(site, loads);
}
void EffectSet::add_to(Wrench& wrench, const BodyMotion& motion) const {
  for (const Active& a : active_) a.effect->body_loads(motion, wrench);
}
void EffectSet::advance(const BodyMotion& motion, double dt_s) {
  for (const Active& a : active_) a.effect->advance(motion, dt_s);
}

}  // namespace rotorloop::sim

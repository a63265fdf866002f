#include "bench/hil/controllers/variant.hpp"

#include <algorithm>

namespace rotorloop::hil {

Variant Variant::external(std::string name) {
  Variant v;
  v.name_ = std::move(name);
  return v;
}

std::string variant_name(const Variant& v) { return v.is_external() ? v.external_name() : std::string(host::name(v.own())); }

std::string variant_label(const Variant& v) {
  if (v.is_external()) return v.external_name();
  switch (v.own()) {
    case Variant::pd_ff:
      return "PD FF";
    case Variant::pd_ff_drag:
      return "PD FF + DRG";
    case Variant::pd_ff_no_effects:
      return "PD FF + THR + DRG, effects off";
    case Variant::pd_ff_thrust_drag:
      return "PD FF + THR + DRG";
  }
  return "?";
}

std::optional<Variant> variant_from_name(std::string_view name) {
  for (const auto v : kAllVariants)
    if (variant_name(v) == name) return v;
  return std::nullopt;
}

bool is_variant_name(std::string_view text) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !text.empty() && text.size() <= 64 && std::all_of(text.begin(), text.end(), good);
}

}  // namespace rotorloop::hil

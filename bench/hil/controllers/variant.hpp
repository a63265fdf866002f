// What flies: one of our controllers, or a program of somebody else under its name. Key of flights, tables and folders.
#pragma once
#include <array>
#include <compare>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/control/controller.hpp"

namespace rotorloop::hil {

// The controller variants of the paper: PD + feed-forward, then drag compensation, then the refined thrust model (with the
// vehicle file's [[effect]]s if it has any; pd_ff_no_effects leaves them out).
class Variant {
 public:
  using enum host::Variant;
  Variant(host::Variant own = pd_ff) : own_(own) {}  // a variant of ours is one wherever a Variant is asked for
  // `name`: see is_variant_name().
  static Variant external(std::string name);

  bool is_external() const { return !name_.empty(); }
  host::Variant own() const { return own_; }                          // of our variants
  const std::string& external_name() const { return name_; }          // empty: one of ours
  friend auto operator<=>(const Variant&, const Variant&) = default;  // ours first

 private:
  std::string name_;
  host::Variant own_;
};

// In the order in which each adds to the one before.
inline constexpr std::array kAllVariants{Variant::pd_ff, Variant::pd_ff_drag, Variant::pd_ff_no_effects, Variant::pd_ff_thrust_drag};
std::string variant_name(const Variant& v);                       // as written in files: "pd_ff_drag"
std::string variant_label(const Variant& v);                      // as in the paper: "PD FF + DRG"
std::optional<Variant> variant_from_name(std::string_view name);  // of ours
bool is_variant_name(std::string_view text);                      // 1 to 64 letters, digits, '_' and '-': it names a folder

// Of ours in the order of kAllVariants, then external ones in order of first appearance in `flown` (anything with .variant).
template <class Flights>
std::vector<Variant> variants_of(const Flights& flown) {
  std::vector<Variant> out;
  const auto add = [&](const Variant& v) {
    for (const Variant& known : out)
      if (known == v) return;
    out.push_back(v);
  };
  for (const Variant v : kAllVariants)
    for (const auto& f : flown)
      if (f.variant == v) add(v);
  for (const auto& f : flown) add(f.variant);
  return out;
}

}  // namespace rotorloop::hil

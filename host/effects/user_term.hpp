// Terms that a user writes in a TOML file, without compiling: each parameter, zero when the effect is absent, multiplies expressions for
// force and torque on the body. docs/own_terms.md shows how. They join a model like the built-in terms.
//   format = 1
//   [[term]]
//   id = "lateral_spring"
//   name = "Spring to the side wall"
//   [[term.parameter]]
//   name = "stiffness_N_m"
//   unit = "N/m"
//   min = 0.0
//   max = 5.0
//   scale = 0.5
//   force_x = "-y * (1 - up_z)"   # any of force_x … torque_z, in body axes
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/effects/term.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::host {

// Owns the terms of one file; they point into it.
class UserTerms {
 public:
  // Throws Error (usage) that names file, line, expression and place. An id of the catalogue is refused.
  static UserTerms read(const std::filesystem::path& path, const EffectCatalogue& catalogue);
  static UserTerms parse(std::string_view text, const std::filesystem::path& name_for_errors, const EffectCatalogue& catalogue);
  UserTerms(UserTerms&&) noexcept;
  UserTerms& operator=(UserTerms&&) noexcept;
  ~UserTerms();

  std::size_t size() const { return terms_.size(); }
  const Term& operator[](std::size_t i) const;
  std::string_view title(std::size_t i) const;  // `name` of the file
  const Term* find(std::string_view id) const;

  // Makes vehicle files with these terms readable.
  void join(EffectCatalogue& catalogue) const;

 private:
  struct Entry;
  UserTerms() = default;
  std::vector<std::unique_ptr<const Entry>> terms_;
  friend class UserTermReader;
};

}  // namespace rotorloop::host

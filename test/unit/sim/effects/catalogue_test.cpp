// The catalogue docs/effects.toml is complete, and says of every effect of the plant what its code says.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "host/base/toml_file.hpp"
#include "sim/effects/effect_set.hpp"

namespace rotorloop::sim {
namespace {

struct Entry {
  std::string parameter, unit;
  std::vector<double> range;
  double neutral;
  bool plant;
};

bool is_id(const std::string& s) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !s.empty() && s[0] >= 'a' && s[0] <= 'z' && std::all_of(s.begin(), s.end(), allowed);
}
// E1 to E29.
bool is_reference(const std::string& s) {
  return (s.size() == 2 || s.size() == 3) && s[0] == 'E' &&
         std::all_of(s.begin() + 1, s.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::map<std::string, Entry> read_catalogue() {
  const TomlFile file = TomlFile::read(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "docs/effects.toml");
  (void)file.format({1});
  std::map<std::string, Entry> out;
  for (const TomlTable& t : file.root().tables("effect", 1, 1000)) {
    const std::string id = t.text("id");
    for (const char* field : {"name", "equation", "symbols", "parameter", "unit", "sign", "typical", "source", "betrayed_by", "manoeuvre"})
      EXPECT_GT(t.text(field).size(), field == std::string("unit") ? 0u : 2u) << id << "." << field;
    EXPECT_FALSE(t.texts("confounders").empty()) << id;
    for (const auto& c : t.texts("confounders")) EXPECT_FALSE(c.empty()) << id;
    (void)t.choice("class", {"separable", "class_only", "not_observable"});
    EXPECT_TRUE(is_reference(t.text("reference"))) << id << ".reference = " << t.text("reference");
    EXPECT_TRUE(is_id(id)) << id;
    Entry e{t.text("parameter"), t.text("unit"), t.numbers("range", 2, {-1e6, 1e6, "1"}), t.number("neutral", {-1e6, 1e6, "1"}),
            t.boolean("plant")};
    EXPECT_TRUE(out.emplace(id, e).second) << id << " occurs twice";
  }
  file.refuse_unknown_keys();
  return out;
}

TEST(EffectCatalogue, EveryEffectOfThePlantIsDescribedWithItsOwnParameterUnitAndRange) {
  const auto catalogue = read_catalogue();
  for (const Effect* e : builtin_effects()) {
    ASSERT_TRUE(catalogue.contains(std::string(e->id))) << e->id << " has no entry in docs/effects.toml";
    const Entry& entry = catalogue.at(std::string(e->id));
    EXPECT_TRUE(entry.plant) << e->id;
    EXPECT_EQ(entry.parameter, e->parameter.key) << e->id;
    EXPECT_EQ(entry.unit, e->parameter.unit) << e->id;
    EXPECT_EQ(entry.range, (std::vector{e->parameter.min, e->parameter.max})) << e->id;
    EXPECT_EQ(entry.neutral, e->parameter.neutral) << e->id;
  }
}
TEST(EffectCatalogue, WhatItSaysThePlantHasThePlantHas) {
  for (const auto& [id, entry] : read_catalogue()) EXPECT_EQ(entry.plant, find_effect(id) != nullptr) << id;
}

}  // namespace
}  // namespace rotorloop::sim

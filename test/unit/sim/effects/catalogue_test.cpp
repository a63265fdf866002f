// The catalogue effects/catalogue.toml is complete, and says of every effect of the plant what its code says.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include "host/base/toml_file.hpp"
#include "sim/effects/effect_set.hpp"

namespace rotorloop::sim {
namespace {

struct Option {
  std::string key, unit;
  std::vector<double> range;
  double fallback;
};
struct Entry {
  std::string parameter, unit;
  std::vector<double> range;
  double neutral;
  bool plant;
  std::vector<std::string> confounders;
  std::string kind;
  std::vector<Option> options;
  std::string numbers;  // "E23 L2, L3": survey and library
};

bool is_id(const std::string& s) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !s.empty() && s[0] >= 'a' && s[0] <= 'z' && std::all_of(s.begin(), s.end(), allowed);
}

const std::map<std::string, Entry>& catalogue() {
  static const std::map<std::string, Entry> entries = [] {
    const TomlFile file = TomlFile::read(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "effects/catalogue.toml");
    (void)file.format({2});
    std::map<std::string, Entry> out;
    for (const TomlTable& t : file.root().tables("effect", 1, 1000)) {
      const std::string id = t.text("id");
      for (const char* field :
           {"name", "equation", "symbols", "parameter", "unit", "sign", "typical", "source", "betrayed_by", "manoeuvre"})
        EXPECT_GT(t.text(field).size(), field == std::string("unit") || field == std::string("parameter") ? 0u : 2u) << id << "." << field;
      EXPECT_TRUE(is_id(id)) << id;
      const std::string held = t.choice("kind", {"term", "dynamic", "sensor", "parameter", "variance", "none"});
      EXPECT_EQ(t.has("fit") && !t.texts("fit").empty(), held == "parameter") << id << ": what the fit itself holds names its parameters";
      const double typical_value = t.number("typical_value", {-1e6, 1e6, "1"});
      Entry e{t.text("parameter"),
              t.text("unit"),
              t.numbers("range", 2, {-1e6, 1e6, "1"}),
              t.number("neutral", {-1e6, 1e6, "1"}),
              t.boolean("plant"),
              t.texts("confounders"),
              t.choice("class", {"separable", "class_only", "not_observable"}),
              {},
              t.text("survey") + ", " + t.text("library")};
      EXPECT_GE(typical_value, e.range[0]) << id;
      EXPECT_LE(typical_value, e.range[1]) << id;
      EXPECT_NE(typical_value, e.neutral) << id;
      EXPECT_NE(t.text("next", "none"), "") << id;
      const auto same = t.has("twins") ? t.texts("twins") : std::vector<std::string>{};
      EXPECT_EQ(!same.empty(), e.kind == "class_only") << id << ": class_only names `twins`, others have none";
      EXPECT_EQ(t.has("needs"), e.kind == "not_observable") << id << ": not_observable says what else is needed, others do not";
      EXPECT_GT(t.text("needs", "none").size(), 2u) << id;
      EXPECT_EQ(t.has("why_not_in_plant"), !e.plant) << id;
      EXPECT_GT(t.text("why_not_in_plant", "it is in the plant").size(), 10u) << id;
      EXPECT_FALSE(t.text("survey").empty()) << id << ": E-number of the plant survey, or -";
      EXPECT_FALSE(t.text("library").empty()) << id << ": L-number of the identification library, or -";
      if (t.has("option"))
        for (const TomlTable& o : t.tables("option", 1, 8))
          e.options.push_back(
              {o.text("key"), o.text("unit"), o.numbers("range", 2, {-1e6, 1e6, "1"}), o.number("default", {-1e6, 1e6, "1"})});
      if (t.has("model")) {  // parameters of the model's term; test/unit/host/effects compares them with the term
        for (const TomlTable& m : t.tables("model", 1, 16)) {
          const std::string key = id + "." + m.text("key");
          const auto range = m.numbers("range", 2, {-1e6, 1e6, "1"});
          const double neutral = m.number("neutral", {-1e6, 1e6, "1"});
          EXPECT_TRUE(range[0] < range[1] && range[0] <= neutral && neutral <= range[1]) << key;
          EXPECT_FALSE(m.text("unit").empty()) << key;
        }
      }
      for (const auto& other : same) e.confounders.push_back(other);
      EXPECT_TRUE(out.emplace(id, e).second) << id << " occurs twice";
    }
    file.refuse_unknown_keys();
    return out;
  }();
  return entries;
}

TEST(EffectCatalogue, HoldsAtLeastFortyEffects) { EXPECT_GE(catalogue().size(), 40u); }

TEST(EffectCatalogue, EveryEffectOfThePlantIsDescribedWithItsOwnParameterUnitAndRange) {
  for (const EffectInfo* e : builtin_effects()) {
    ASSERT_TRUE(catalogue().contains(std::string(e->id))) << e->id << " has no entry in effects/catalogue.toml";
    const Entry& entry = catalogue().at(std::string(e->id));
    EXPECT_TRUE(entry.plant) << e->id;
    EXPECT_EQ(entry.parameter, e->parameter.key) << e->id;
    EXPECT_EQ(entry.unit, e->parameter.unit) << e->id;
    EXPECT_EQ(entry.range, (std::vector{e->parameter.min, e->parameter.max})) << e->id;
    EXPECT_EQ(entry.neutral, e->parameter.neutral) << e->id;
    ASSERT_EQ(entry.options.size(), e->options.size()) << e->id;
    for (std::size_t i = 0; i < e->options.size(); ++i) {
      EXPECT_EQ(entry.options[i].key, e->options[i].key) << e->id;
      EXPECT_EQ(entry.options[i].unit, e->options[i].unit) << e->id << "." << e->options[i].key;
      EXPECT_EQ(entry.options[i].range, (std::vector{e->options[i].min, e->options[i].max})) << e->id << "." << e->options[i].key;
      EXPECT_EQ(entry.options[i].fallback, e->options[i].fallback) << e->id << "." << e->options[i].key;
    }
  }
}
TEST(EffectCatalogue, WhatItSaysThePlantHasThePlantHas) {
  for (const auto& [id, entry] : catalogue()) EXPECT_EQ(entry.plant, find_effect(id) != nullptr) << id;
}
TEST(EffectCatalogue, CoversEveryNumberOfTheSurveyAndOfTheLibrary) {
  std::set<std::string> found;
  for (const auto& [id, entry] : catalogue()) {
    std::istringstream numbers(entry.numbers);
    for (std::string n; std::getline(numbers, n, ',');) found.insert(n.substr(n.find_first_not_of(' ')));
  }
  std::set<std::string> expected;
  for (int e = 1; e <= 29; ++e) expected.insert("E" + std::to_string(e));
  for (int l = 1; l <= 44; ++l) expected.insert("L" + std::to_string(l));
  for (const auto& n : expected) EXPECT_TRUE(found.contains(n)) << n << " stands in no entry";
  for (const auto& n : found) EXPECT_TRUE(n == "-" || expected.contains(n)) << n;
}
TEST(EffectCatalogue, IndistinguishableAndConfoundersThatLookLikeIdsExist) {
  for (const auto& [id, entry] : catalogue()) {
    EXPECT_FALSE(entry.confounders.empty()) << id;
    for (const std::string& c : entry.confounders)
      EXPECT_TRUE(!is_id(c) || c.find('_') == std::string::npos || catalogue().contains(c)) << id << " names " << c;
  }
}

}  // namespace
}  // namespace rotorloop::sim

// The list of names that a person chooses from: nothing is missing, and every name on it is one that the options take.
#include "bench/sysid/identify/parameter_names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "bench/sysid/identify/parameter_choice.hpp"

namespace rotorloop::identify {
namespace {

using testing::HasSubstr;

// The line that begins with this name, or nothing.
std::string line_of(const std::string& table, const std::string& name) {
  std::istringstream in(table);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("  " + name + " ")) return line;
  }
  return "";
}

TEST(ParameterNames, EveryParameterStandsWithSymbolUnitAndAMeaningOfItsOwn) {
  const std::string table = names_table(host::builtin_effect_catalogue());
  std::set<std::string_view> meanings;
  for (int p = 0; p < estimate::kCoreParameters; ++p) {
    const estimate::ParameterInfo info = estimate::parameter_info(p, {});
    const std::string line = line_of(table, info.name), meaning(meaning_of(static_cast<estimate::Parameter>(p)));
    EXPECT_THAT(line, HasSubstr(" " + info.symbol + " "));
    EXPECT_THAT(line, HasSubstr(" " + info.unit + " "));
    EXPECT_TRUE(line.ends_with(meaning)) << line;
    EXPECT_TRUE(meanings.insert(meaning_of(static_cast<estimate::Parameter>(p))).second) << meaning;
  }
  EXPECT_THAT(meaning_of(estimate::kIzz), HasSubstr("yaw"));
  EXPECT_THAT(meaning_of(estimate::kCdz), HasSubstr("along z"));
  EXPECT_THAT(meaning_of(estimate::kCommandLag), HasSubstr("time constant"));
}

TEST(ParameterNames, EveryGroupOnTheListIsTakenByTheOptions) {
  const std::string table = names_table(host::builtin_effect_catalogue()), head = "Groups of them: ";
  const auto at = table.find(head);
  ASSERT_NE(at, std::string::npos);
  std::istringstream in(table.substr(at + head.size(), table.find('\n', at) - at - head.size()));
  std::set<std::string> seen;
  for (std::string group; std::getline(in >> std::ws, group, ',');) {
    EXPECT_GT(parameters_named(group, {}).size(), 1u) << group;
    seen.insert(group);
  }
  EXPECT_THAT(seen, testing::IsSupersetOf({"drag", "pose_sensor", "pose_sensor.offset", "body.inertia", "accel_bias"}));
}

TEST(ParameterNames, EveryTermStandsWithItsNameInTheCatalogueAndItsParameters) {
  const host::EffectCatalogue catalogue = host::builtin_effect_catalogue();
  const std::string table = names_table(catalogue);
  for (const host::Term& term : host::all_terms()) {
    const std::string id(term.info.id), line = line_of(table, id);
    EXPECT_THAT(line, HasSubstr(catalogue.find(id)->name)) << id;
    for (const host::TermParameter& p : term.info.parameters)
      EXPECT_THAT(line, HasSubstr(std::string(p.name) + " [" + std::string(p.unit) + "]")) << id;
  }
}

}  // namespace
}  // namespace rotorloop::identify

// From [[effect]]s of a vehicle file to what the controller carries: order, values, what is left out, what is refused.
#include <gtest/gtest.h>

#include "host/base/error.hpp"
#include "host/effects/vehicle_terms_file.hpp"

namespace rotorloop::host {
namespace {

VehicleEffect effect(const std::string& id, const std::vector<std::pair<std::string, double>>& parameters) {
  VehicleEffect e{id, {}, {}};
  for (const auto& [name, value] : parameters) e.parameters.push_back({name, {value, 0.0, Origin::flight}});
  return e;
}
VehicleFile with(std::vector<VehicleEffect> effects) {
  VehicleFile v;
  v.effects = std::move(effects);
  return v;
}
std::string refusal(const VehicleFile& v) {
  try {
    terms_of(v, "v.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "accepted";
}

TEST(TermsOfAVehicleFile, StandInTheOrderOfLoadsWithTheFilesValuesAndNeutralOnesForTheRest) {
  const FileTerms t = terms_of(with({effect("body_force_bias", {{"y_N", 0.2}}), effect("thrust_scale", {{"scale", 0.9}})}), "v.toml");
  ASSERT_EQ(t.terms.list.size(), 2u);
  EXPECT_EQ(t.terms.list.term(0).info.id, "thrust_scale");
  EXPECT_EQ(t.terms.list.term(1).info.id, "body_force_bias");
  const auto values = [&](std::size_t i, std::size_t k) { return t.terms.values[t.terms.list.first_parameter(i) + k]; };
  EXPECT_EQ(values(0, 0), 0.9);
  EXPECT_EQ(values(1, 0), 0.0);
  EXPECT_EQ(values(1, 1), 0.2);
  EXPECT_TRUE(t.not_flown.empty());
}

TEST(TermsOfAVehicleFile, EffectsThatAreNoLoadAreNamedAsNotFlown) {
  const FileTerms t = terms_of(with({effect("pose_scale", {{"error", 0.02}}), effect("motor_flux", {{"scale", 0.93}})}), "v.toml");
  EXPECT_TRUE(t.terms.empty());
  EXPECT_EQ(t.not_flown, (std::vector<std::string>{"pose_scale", "motor_flux"}));
}

TEST(TermsOfAVehicleFile, AStringedLoadHangsAtRestWhateverItsStartWas) {
  const FileTerms t = terms_of(with({effect("slung_load", {{"mass_kg", 0.05}, {"start_d_x", 0.3}})}), "v.toml");
  EXPECT_EQ(t.terms.values[t.terms.list.first_parameter(0)], 0.05);
  EXPECT_EQ(t.terms.values[t.terms.list.first_start(0)], 0.0);
}

TEST(TermsOfAVehicleFile, AValueOutsideItsBoundsAnUnknownParameterAndARepeatedEffectAreRefused) {
  EXPECT_NE(refusal(with({effect("blockage_strut", {{"loss", 0.5}})})).find("loss = 0.5 1 is outside [0, 0.3]"), std::string::npos);
  EXPECT_NE(refusal(with({effect("blockage_strut", {{"gain", 0.1}})})).find("has no parameter \"gain\""), std::string::npos);
  const VehicleEffect once = effect("blockage_strut", {{"loss", 0.1}});
  EXPECT_NE(refusal(with({once, once})).find("cannot be added"), std::string::npos);
}

}  // namespace
}  // namespace rotorloop::host

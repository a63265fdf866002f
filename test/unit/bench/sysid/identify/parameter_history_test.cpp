// Results of several trials, read back and drawn side by side.
#include "bench/sysid/identify/report/parameter_history.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/error.hpp"

namespace rotorloop::identify {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json entry(const std::string& symbol, double value, double u, const std::string& unit) {
  return {{"symbol", symbol}, {"flight", nullptr}, {"value", value}, {"u", u}, {"u_robust", 2.0 * u}, {"unit", unit}};
}
// A result of a trial: k_1, q_BS about a start value of the trial's own, and c_t.
json trial(double k1, const Eigen::Quaterniond& start, const Eigen::Quaterniond& q) {
  json j = {{"format", 1}, {"command", "identify"}};
  j["estimates"] = {entry("k_1", k1, 1e-8, "N s2")};
  const Eigen::Vector3d turn = estimate::log_q(start.conjugate() * q);
  for (int i = 0; i < 3; ++i) j["estimates"].push_back(entry(std::string("q_BS,") + "xyz"[i], turn[i], 1e-3, "rad"));
  j["derived"] = {entry("c_t", 0.8 * k1, 1e-9, "N s2")};
  j["q_BS_wxyz"] = {q.w(), q.x(), q.y(), q.z()};
  return j;
}

class ParameterHistory : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }
  fs::path put(const std::string& folder, const json& j) const {
    fs::create_directories(root_ / folder);
    std::ofstream(root_ / folder / "result.json") << j.dump();
    return root_ / folder;
  }
  std::string refusal(const json& j) const {
    try {
      (void)read_history_point(put("bad", j));
    } catch (const Error& e) {
      return e.what();
    }
    return "accepted";
  }
  const Eigen::Quaterniond tilted_ = estimate::exp_q({0.05, -0.02, 0.1});
  const fs::path root_ = fs::path(::testing::TempDir()) / ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

double value_of(const HistoryPoint& p, const std::string& name) {
  for (std::size_t i = 0; i < p.names.size(); ++i) {
    if (p.names[i] == name) return p.value[i];
  }
  return NAN;
}

TEST_F(ParameterHistory, ReadsEstimatesAndWhatFollowsFromThemWithTheLargerUncertainty) {
  const HistoryPoint p = read_history_point(put("monday", trial(2.4e-6, tilted_, tilted_)));
  EXPECT_EQ(p.label, "monday");
  EXPECT_EQ(p.names, (std::vector<std::string>{"k_1", "q_BS,x", "q_BS,y", "q_BS,z", "c_t"}));
  EXPECT_EQ(p.value.front(), 2.4e-6);
  EXPECT_EQ(p.u.front(), 2e-8);
  EXPECT_EQ(value_of(p, "c_t"), 0.8 * 2.4e-6);
  EXPECT_LT(p.q_BS->angularDistance(tilted_), 1e-12);
}

TEST_F(ParameterHistory, LeavesOutWhatBelongsToASingleFlight) {
  json j = trial(2.4e-6, tilted_, tilted_);
  j["estimates"][0]["flight"] = "vertical";
  EXPECT_TRUE(std::isnan(value_of(read_history_point(put("monday", j)), "k_1")));
}

TEST_F(ParameterHistory, TellsFoldersOfTheSameNameApartByWhereTheyStand) {
  const json j = trial(2.4e-6, tilted_, tilted_);
  const auto history = read_history({put("run1/report", j), put("run2/report", j), put("tuesday", j)});
  ASSERT_EQ(history.size(), 3u);
  EXPECT_EQ(history[0].label, "run1/report");
  EXPECT_EQ(history[1].label, "run2/report");
  EXPECT_EQ(history[2].label, "tuesday");
}

TEST_F(ParameterHistory, CountsTheSensorsRotationFromOneWhateverEachFitStartedFrom) {
  // The same sensor, found from two start values that differ by 3 degrees: one rotation, two rotation vectors.
  const Eigen::Quaterniond other_start = tilted_ * estimate::exp_q({0.0, 0.05, 0.0});
  const std::vector<fs::path> paths{put("a", trial(2.4e-6, tilted_, tilted_)), put("b", trial(2.4e-6, other_start, tilted_))};
  auto history = read_history(paths);
  ASSERT_GT(std::fabs(value_of(history[0], "q_BS,y") - value_of(history[1], "q_BS,y")), 0.04) << "as each result says it";
  EXPECT_EQ(count_rotations_from_one(history, {}), "a");
  for (const char* axis : {"q_BS,x", "q_BS,y", "q_BS,z"}) EXPECT_NEAR(value_of(history[1], axis), 0.0, 1e-12) << axis;

  // With a file beside, from that file's rotation.
  history = read_history(paths);
  EXPECT_EQ(count_rotations_from_one(history, {{.label = "cad.toml", .value = {}, .q_BS = Eigen::Quaterniond::Identity()}}), "cad.toml");
  EXPECT_NEAR(value_of(history[1], "q_BS,z"), 0.1, 1e-12);
}

TEST_F(ParameterHistory, LeavesOutTheRotationOfResultsThatDoNotSayItAndSaysSo) {
  json old = trial(2.3e-6, tilted_, tilted_);
  old.erase("q_BS_wxyz");
  old.erase("derived");
  const std::string html = history_html(read_history({put("older", old), put("newer", trial(2.4e-6, tilted_, tilted_))}), {});
  EXPECT_NE(html.find("Left out for q_BS, as their results do not say the rotation: older."), std::string::npos) << html.substr(0, 600);
  EXPECT_NE(html.find("rotation from that of newer"), std::string::npos);
}

TEST_F(ParameterHistory, DrawsLabelsOfTrialsTheReferenceAndShortTicks) {
  std::vector<fs::path> paths;
  for (int i = 0; i < 6; ++i) paths.push_back(put("trial number " + std::to_string(i), trial(2.4e-6 + 1e-8 * i, tilted_, tilted_)));
  const HistoryReference stand{.label = "stand.toml", .value = {{"k_1", 2.41e-6}, {"c_t", 1.9e-6}}, .q_BS = tilted_};
  const std::string html = history_html(read_history(paths), {stand});
  for (const char* part : {"trial number 0</text>", "trial number 5</text>", "rotate(-35", "k_1, 10⁻⁶ N s²", "c_t, 10⁻⁶ N s²",
                           ">2.40</text>", ">stand.toml</text>"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  EXPECT_EQ(html.find("0.0000024"), std::string::npos);
  EXPECT_EQ(history_html(read_history({paths.front()}), {stand}), "") << "one trial is no history";
}

TEST_F(ParameterHistory, RefusesWhatIsNoResultOfIdentifyByName) {
  EXPECT_NE(refusal({{"command", "hil"}}).find("is no result of `rotorloop identify`"), std::string::npos);
  EXPECT_NE(refusal({{"command", "identify"}, {"format", 9}}).find("format"), std::string::npos);
  json j = trial(2.4e-6, tilted_, tilted_);
  j["estimates"][0].erase("unit");
  EXPECT_NE(refusal(j).find("an estimate without unit"), std::string::npos) << refusal(j);
  j = trial(2.4e-6, tilted_, tilted_);
  j["q_BS_wxyz"] = {1, 0};
  EXPECT_NE(refusal(j).find("q_BS_wxyz"), std::string::npos) << refusal(j);
}

}  // namespace
}  // namespace rotorloop::identify

// `rotor fit` knows no propeller by name: folders of the measured data under other names give the figures of `rotor validate`, and what is
// written turns in a plant. Needs the data folder; takes about 15 s.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "bench/propeller/fit/blade_files.hpp"
#include "sim/rotor/bem.hpp"
#include "sim/rotor/blade.hpp"
#include "sim/rotor/rotor.hpp"
#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {

namespace fs = std::filesystem;

class RotorFit : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("ROTORLOOP_DATA") == nullptr)
      GTEST_SKIP() << "ROTORLOOP_DATA is not set: rotor fit is not compared with rotor validate";
    inputs_.data = std::getenv("ROTORLOOP_DATA");
    inputs_.shipped_polars = ROTORLOOP_SOURCE_DIR "/vehicles/polars";
    folder_ = fs::temp_directory_path() / ("rotorloop_fit" + std::to_string(::getpid()));
  }
  void TearDown() override { fs::remove_all(folder_); }

  // The folder's files under names that say nothing but a sweep's speed, which no file of these holds.
  fs::path renamed(const std::string& key) {
    const fs::path from = inputs_.data / "propellers" / key, to = folder_ / "files";
    fs::remove_all(to);
    fs::create_directories(to);
    char letter = 'a';
    for (const auto& file : fs::directory_iterator(from)) {
      const std::string name = file.path().filename().string();
      const auto end = name.rfind('_');
      fs::copy_file(file.path(),
                    to / (std::string(1, letter++) + (end == std::string::npos ? file.path().extension().string() : name.substr(end))));
    }
    return to;
  }
  BladeFit fitted(const std::vector<fs::path>& files, std::optional<double> diameter_m) const {
    PropellerFileOptions o;
    o.diameter_m = diameter_m;
    return fit_any_blade(read_propeller_files(files, o), inputs_, "any");
  }
  // What was written, read as a plant reads it, carries more with speed, less in climb, and takes power, at tip speeds of flight.
  void expect_turns_in_a_plant(const BladeFit& fit) const {
    const fs::path out = folder_ / "blades/any.toml";
    for (const auto& [path, text] : blade_files(fit, out, "test")) {
      fs::create_directories(path.parent_path());
      std::ofstream(path) << text;
    }
    const sim::Rotor rotor(sim::read_blade(out));
    double before_N = 0.0;
    for (const double tip_m_s : {40.0, 70.0, 100.0}) {
      const auto loads = [&](const Eigen::Vector3d& v) {
        sim::RotorCondition c;
        c.omega_rad_s = tip_m_s / rotor.radius_m();
        c.v_R_m_s = v;
        c.density_kg_m3 = 1.2;
        sim::RotorWarmStart cold;
        return sim::solve_rotor(rotor, c, cold);
      };
      const auto still = loads({0, 0, 0}), climb = loads({0, 0, 3.0}), across = loads({8.0, 0, -0.5});
      EXPECT_GT(still.force_R_N.z(), before_N);
      EXPECT_LT(climb.force_R_N.z(), still.force_R_N.z());
      EXPECT_GT(still.shaft_torque_N_m, 0.0);
      EXPECT_TRUE(std::isfinite(across.force_R_N.x()) && std::isfinite(across.shaft_torque_N_m));
      before_N = still.force_R_N.z();
    }
  }

  PropellerInputs inputs_;
  fs::path folder_;
};

// A geometry, tables of static rows and of sweeps: made up, no propeller's.
const char* const kGeometry = "r/R c/R beta\n0.15 0.120 41.4\n0.30 0.159 36.4\n0.50 0.178 25.8\n0.75 0.180 18.9\n1.00 0.022 15.5\n";
std::string static_rows(double from_rpm, double ct, int rows) {
  std::string s = "RPM CT CP\n";
  for (int i = 0; i < rows; ++i) s += std::to_string(from_rpm + 500.0 * i) + " " + std::to_string(ct) + " 0.055\n";
  return s;
}

class PropellerFolder : public RotorFit {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("rotorloop_folder" + std::to_string(::getpid()));
    write("geom.txt", kGeometry);
  }
  void write(const std::string& name, const std::string& text) {
    fs::create_directories(folder_);
    std::ofstream(folder_ / name) << text;
  }
  PropellerFiles read() const {
    PropellerFileOptions o;
    o.diameter_m = 0.2;
    return read_propeller_files({folder_}, o);
  }
};

TEST_F(PropellerFolder, StaticTablesOfOverlappingSpeedsAreKeptApartAndThoseThatFollowEachOtherAreOne) {
  write("a_static.txt", static_rows(2000, 0.118, 5));
  write("b_static.txt", static_rows(2200, 0.108, 7));
  const PropellerFiles two = read();
  ASSERT_EQ(two.sets.size(), 2u);
  EXPECT_EQ(two.sets[0].label, "static");
  EXPECT_EQ(two.sets[0].rows.size(), 7u) << "the longer one is fitted";
  EXPECT_EQ(two.sets[1].label, "static, a_static.txt");
  EXPECT_EQ(two.sets[1].rows.size(), 5u);
  ASSERT_FALSE(two.remarks.empty());
  EXPECT_NE(two.remarks.back().find("a_static.txt overlaps b_static.txt in speed, another run or specimen"), std::string::npos);
  write("b_static.txt", static_rows(4600, 0.118, 7));
  EXPECT_EQ(read().sets.front().rows.size(), 12u);
}

TEST_F(PropellerFolder, SweepsOfOneSpeedGoByTheirFilesAndAMakersPredictionIsNeverTheOneThatIsFitted) {
  write("static.txt", static_rows(2000, 0.118, 5));
  const std::string sweep = "J CT CP eta\n0.2 0.10 0.05 0.4\n0.3 0.08 0.048 0.5\n0.5 0.05 0.04 0.625\n0.7 0.005 0.02 0.175\n";
  write("a_3000.txt", sweep);
  write("b_3000.txt", sweep);
  write("PER3.dat", " PROP RPM = 2600\n V J Pe Ct Cp\n 0 0.2 0.4 0.10 0.05\n 1 0.7 0.1 0.001 0.02\n");
  PropellerFiles files = read();
  std::vector<std::string> labels;
  for (const MeasuredSet& s : files.sets) labels.push_back(s.label);
  EXPECT_EQ(labels.size(), 4u);
  EXPECT_EQ(std::count(labels.begin(), labels.end(), "J 3000 rpm, b_3000.txt"), 1);
  EXPECT_EQ(files.sets[sweep_to_fit(files.sets)].rows.front().rpm, 3000.0);
  EXPECT_EQ(files.sets[sweep_to_fit(files.sets, 2600.0)].rows.front().rpm, 3000.0) << "although the prediction is of just that speed";
  std::erase_if(files.sets, [](const MeasuredSet& s) { return s.label.starts_with("J "); });
  EXPECT_EQ(sweep_to_fit(files.sets), 0u) << "a prediction alone: no sweep is fitted";
}

TEST(RotorFitVerdict, IsFittedWithTwoThirdsOfTheSweepsWithinTheirLimitsAndNamesEachSetThatMisses) {
  BladeFit f;
  EXPECT_EQ(verdict_text(f), "unfitted: there are no measurements");
  f.fitted = true;
  EXPECT_TRUE(holds(f));
  EXPECT_EQ(verdict_text(f), "fitted");
  f.misses = {"C_T of J 4031 rpm: 28.1 %, allowed 10 %"};
  f.sweeps_held_out = 3;
  f.sweeps_within = 2;
  EXPECT_TRUE(holds(f));
  EXPECT_EQ(verdict_text(f), "fitted, but not for C_T of J 4031 rpm: 28.1 %, allowed 10 %");
  f.sweeps_held_out = 4;
  EXPECT_FALSE(holds(f)) << "half of the sweeps";
  EXPECT_EQ(verdict_text(f), "unfitted: C_T of J 4031 rpm: 28.1 %, allowed 10 %");
  f.sweeps_held_out = 0;
  f.static_within = false;
  EXPECT_FALSE(holds(f)) << "a static table beyond its limits";
}

// Held-out scores of each part: (static or sweep by its speed) -> errors.
void expect_alike(const std::vector<SetScore>& any, const std::vector<SetScore>& known, const std::string& title) {
  ASSERT_EQ(any.size(), known.size()) << title;
  std::vector<bool> used(known.size());
  for (const SetScore& a : any) {
    if (a.fitted.rows == 0) continue;
    // Sets of one propeller differ by more than what is compared: the like one is the nearest.
    std::size_t nearest = known.size();
    for (std::size_t k = 0; k < known.size(); ++k)
      if (!used[k] && known[k].part == a.part && known[k].is_static == a.is_static && known[k].fitted.rows == a.fitted.rows &&
          (nearest == known.size() || std::abs(known[k].fitted.ct - a.fitted.ct) < std::abs(known[nearest].fitted.ct - a.fitted.ct)))
        nearest = k;
    ASSERT_LT(nearest, known.size()) << title << " " << a.label;
    used[nearest] = true;
    EXPECT_NEAR(a.fitted.ct, known[nearest].fitted.ct, 0.002) << title << " " << a.label;
    EXPECT_NEAR(a.fitted.cp, known[nearest].fitted.cp, 0.002) << title << " " << a.label;
    std::printf("[ measured ] %s %s, %s: %.1f / %.1f %%, rotor validate %.1f / %.1f %%\n", title.c_str(), a.label.c_str(),
                a.part == Part::held_out ? "held out" : "fitted", 100 * a.fitted.ct, 100 * a.fitted.cp, 100 * known[nearest].fitted.ct,
                100 * known[nearest].fitted.cp);
  }
}

TEST_F(RotorFit, FiguresOfFoldersUnderOtherNamesAreThoseOfRotorValidateWithin0p2PointsAndTheBladeTurnsInAPlant) {
  for (const CataloguedPropeller& entry : propeller_catalogue()) {
    if (!fs::exists(inputs_.data / "propellers" / entry.key) || entry.static_rows.empty()) continue;
    const PropellerResult known = validate(read_measured_propeller(inputs_, entry));
    const BladeFit any = fitted({renamed(entry.key)}, entry.diameter_m);
    ASSERT_TRUE(any.fitted) << entry.title;
    for (const GeometryResult& g : any.result.front().geometries)
      for (const GeometryResult& k : known.geometries)
        if (g.source == k.source) expect_alike(g.scores, k.scores, entry.title + " " + g.source);
    const auto& scores = any.result.front().geometries[any.best].scores;
    const auto sweeps = std::count_if(any.result.front().propeller.sets.begin(), any.result.front().propeller.sets.end(),
                                      [](const MeasuredSet& s) { return s.judged && !s.fitted && s.label.starts_with("J "); });
    EXPECT_EQ(any.sweeps_held_out, sweeps) << "held out whole: " << scores.size() << " scores in all";
    expect_turns_in_a_plant(any);
    const std::string file = blade_files(any, folder_ / "blades/any.toml", "test").back().second;
    EXPECT_NE(file.find("# Verdict: " + verdict_text(any) + "."), std::string::npos);
    std::printf("[ measured ] %s: %s\n", entry.title.c_str(), verdict_text(any).c_str());
  }
}

TEST_F(RotorFit, SectionsInABladeElementProgramsFileAreFittedAndAGeometryWithoutMeasurementsIsMarkedUnfitted) {
  const fs::path from = inputs_.data / "propellers/tmotor28";  // the coaxial files beside these are of two rotors
  fs::create_directories(folder_);
  fs::copy_file(from / "tmotor28.ini", folder_ / "a.ini");
  fs::copy_file(from / "tmotor28_data.csv", folder_ / "b.csv");
  const BladeFit sections = fitted({folder_ / "a.ini", folder_ / "b.csv"}, std::nullopt);
  ASSERT_TRUE(sections.fitted);
  for (const SetScore& s : sections.result.front().geometries[sections.best].scores) {
    if (!s.is_static || s.part != Part::held_out) continue;
    EXPECT_LT(s.fitted.ct, kStaticThrustMost);
    EXPECT_LT(s.fitted.cp, kStaticPowerMost);
    std::printf("[ measured ] T-Motor 28 in, static held out: %.1f / %.1f %%\n", 100 * s.fitted.ct, 100 * s.fitted.cp);
  }
  expect_turns_in_a_plant(sections);
  const BladeFit bare = fitted({inputs_.data / "propellers/dji9443_geom"}, std::nullopt);
  EXPECT_FALSE(bare.fitted);
  EXPECT_NE(blade_files(bare, folder_ / "blades/any.toml", "test").back().second.find("UNFITTED"), std::string::npos);
  expect_turns_in_a_plant(bare);
}

}  // namespace
}  // namespace rotorloop::propeller

// `rotor fit` knows no propeller by name: folders of the measured data under other names give the figures of `rotor validate`, and what is
// written turns in a plant. Needs the data folder; takes about 15 s.
#include <gtest/gtest.h>
#include <unistd.h>

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
    fs::remove_all(to), fs::create_directories(to);
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
        c.omega_rad_s = tip_m_s / rotor.radius_m(), c.v_R_m_s = v, c.density_kg_m3 = 1.2;
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
    expect_turns_in_a_plant(any);
  }
}

TEST_F(RotorFit, SectionsInABladeElementProgramsFileAreFittedAndAGeometryWithoutMeasurementsIsMarkedUnfitted) {
  const fs::path from = inputs_.data / "propellers/tmotor28";  // the coaxial files beside these are of two rotors
  fs::create_directories(folder_);
  fs::copy_file(from / "tmotor28.ini", folder_ / "a.ini"), fs::copy_file(from / "tmotor28_data.csv", folder_ / "b.csv");
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

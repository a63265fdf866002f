// The shipped vehicles hover at the speed that a measured propeller like theirs would need: published static thrust of the nearest one
// (UIUC Propeller Database, read from ROTORLOOP_DATA, none of it in this repository), brought to the diameter by C_T.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "sim/plant/assemble.hpp"

namespace {

using namespace rotorloop::sim;

constexpr double kRpm = std::numbers::pi / 30.0, kGravity = 9.80665;

double hover_rpm(const std::string& vehicle, double& thrust_N, double& diameter_m) {
  const PlantFile plant = read_plant(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles" / vehicle / "plant.toml");
  const SharedRotors rotors = read_rotors(plant);
  thrust_N = plant.body.mass_kg * kGravity / 4.0;
  diameter_m = 2.0 * read_blade(plant.rotors[0].blade_path).radius_m;
  double low = 100.0 * kRpm, high = 60000.0 * kRpm;
  for (int k = 0; k < 50; ++k) {
    RotorCondition c;
    c.omega_rad_s = 0.5 * (low + high);
    c.density_kg_m3 = plant.density_kg_m3;
    RotorWarmStart warm;
    (solve_rotor(*rotors[0], c, warm).force_R_N.z() < thrust_N ? low : high) = c.omega_rad_s;
  }
  return 0.5 * (low + high) / kRpm;
}

// Mean C_T of the upper half of the speeds of a static table: what Reynolds numbers nearest to ours gave.
double static_c_t(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<double> c_t;
  for (std::string line; std::getline(in, line);) {
    std::istringstream s(line);
    double rpm = 0.0, t = 0.0;
    if (s >> rpm >> t) c_t.push_back(t);
  }
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t i = c_t.size() / 2; i < c_t.size(); ++i) {
    sum += c_t[i];
    ++n;
  }
  return n == 0 ? 0.0 : sum / static_cast<double>(n);
}

struct Nearest {
  const char* vehicle;
  const char* table;
};

class ShippedVehicle : public testing::TestWithParam<Nearest> {};

TEST_P(ShippedVehicle, HoversWithin10PercentOfTheSpeedOfTheNearestMeasuredPropeller) {
  const char* data = std::getenv("ROTORLOOP_DATA");
  if (!data) GTEST_SKIP() << "ROTORLOOP_DATA is not set: no measured propellers";
  double thrust_N = 0.0, diameter_m = 0.0;
  const double rpm = hover_rpm(GetParam().vehicle, thrust_N, diameter_m);
  const double c_t = static_c_t(std::filesystem::path(data) / "propellers" / GetParam().table);
  ASSERT_GT(c_t, 0.0);
  const double published_rpm = 60.0 * std::sqrt(thrust_N / (c_t * 1.2 * std::pow(diameter_m, 4)));
  std::printf("[ measured ] %s: hover at %.0f RPM, the nearest measured propeller %.0f RPM (%+.1f %%)\n", GetParam().vehicle, rpm,
              published_rpm, 100.0 * (rpm / published_rpm - 1.0));
  EXPECT_NEAR(rpm, published_rpm, 0.10 * published_rpm);
}

INSTANTIATE_TEST_SUITE_P(Vehicles, ShippedVehicle,
                         testing::Values(Nearest{"quad_3in", "apc_4.2x4/apcff_4.2x4_static_0615rd.txt"},
                                         Nearest{"quad_7in", "da4002_9x6.75/da4002_9x6.75_static.txt"},
                                         Nearest{"quad_10in", "apc_10x7sf/apcsf_10x7_static_kt0827.txt"},
                                         Nearest{"quad_17in", "apc_16x8e/apce_16x8_static_2150od.txt"}));

}  // namespace

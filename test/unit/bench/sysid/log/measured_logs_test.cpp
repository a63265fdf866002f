// Every shipped mapping against the flight set it is for: what physics says of the streams when units, axes and rotor order are right.
// The sets stay outside the repository: without ROTORLOOP_DATA these tests are skipped, and counted as such.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "bench/sysid/log/read_flight.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::log {
namespace {

namespace fs = std::filesystem;
const fs::path kMeasured = fs::path(ROTORLOOP_SOURCE_DIR) / "vehicles/measured";
const std::vector<std::string> kSets{"neurobem_test",     "imrc_cf21bl_bare", "imrc_cf21bl_payload", "idsia_nanodrone_cf21bl",
                                     "imrc_cf21_brushed", "nanobench_cf21",   "crazypad_faults",     "arpl_crazyflie_sysid",
                                     "undeclared_a",      "undeclared_b",     "undeclared_c",        "undeclared_d",
                                     "undeclared_e",      "undeclared_f"};

std::vector<double> linear(const std::vector<double>& t, const std::vector<double>& v, const std::vector<double>& at) {
  std::vector<double> out;
  std::size_t k = 0;
  for (const double x : at) {
    while (k + 2 < t.size() && t[k + 1] < x) ++k;
    const double share = std::clamp((x - t[k]) / (t[k + 1] - t[k]), 0.0, 1.0);
    out.push_back(v[k] + share * (v[k + 1] - v[k]));
  }
  return out;
}

// Mean over ± half samples: the same delay for all that is compared.
std::vector<double> smooth(const std::vector<double>& v, std::size_t half) {
  std::vector<double> out;
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::size_t a = i > half ? i - half : 0, b = std::min(v.size(), i + half + 1);
    double sum = 0.0;
    for (std::size_t k = a; k < b; ++k) sum += v[k];
    out.push_back(sum / static_cast<double>(b - a));
  }
  return out;
}

// Median of five: takes out the single spikes of a telemetry stream, which in squares would outweigh the flight.
std::vector<double> without_spikes(const std::vector<double>& v) {
  std::vector<double> out = v;
  for (std::size_t i = 2; i + 2 < v.size(); ++i) {
    std::array<double, 5> w{v[i - 2], v[i - 1], v[i], v[i + 1], v[i + 2]};
    std::nth_element(w.begin(), w.begin() + 2, w.end());
    out[i] = w[2];
  }
  return out;
}

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  const double n = static_cast<double>(x.size());
  double mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    yy += (y[i] - my) * (y[i] - my);
    xy += (x[i] - mx) * (y[i] - my);
  }
  return xy / std::sqrt(xx * yy);
}

template <class Value>
std::vector<double> component(const Stream<Value>& s, const std::function<double(const Value&)>& pick) {
  std::vector<double> out;
  for (const auto& v : s.value) out.push_back(pick(v));
  return out;
}

class MeasuredLogs : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set: measured flights not read";
    mapping_ = read_log_mapping(kMeasured / (GetParam() + ".mapping.toml"));
    for (const auto& e : fs::directory_iterator(fs::path(std::getenv("ROTORLOOP_DATA")) / "flights" / GetParam()))
      if (e.path().extension() == ".csv" && e.path().stem().string().find("_mocap") == std::string::npos) files_.push_back(e.path());
    std::sort(files_.begin(), files_.end());
    ASSERT_FALSE(files_.empty());
  }
  bool commands_only() const {
    return GetParam() == "nanobench_cf21" || GetParam() == "crazypad_faults" || GetParam() == "arpl_crazyflie_sysid";
  }
  LogMapping mapping_;
  std::vector<fs::path> files_;
};

TEST_P(MeasuredLogs, EveryFlightReadsWithStampsInOrderAndCredibleMagnitudes) {
  for (const auto& file : files_) {
    SCOPED_TRACE(file.filename().string());
    const auto f = read_flight(file, &mapping_);
    EXPECT_EQ(f.rotor_omega_rad_s.empty(), commands_only());
    EXPECT_EQ(f.motor_command.empty(), !commands_only() && GetParam().substr(0, 5) != "imrc_" && GetParam().substr(0, 5) != "idsia");
    const auto span = [&](const std::vector<double>& t) {
      for (std::size_t i = 1; i < t.size(); ++i) EXPECT_GT(t[i], t[i - 1]) << i;
      return t.empty() ? 0.0 : t.back() - t.front();
    };
    const double longest = std::max({span(f.pose.t_s), span(f.position_W_m.t_s), span(f.gyro_B_rad_s.t_s), span(f.motor_command.t_s)});
    EXPECT_GT(longest, 3.5);  // the shortest are the fast swings of imrc_cf21bl_payload
    EXPECT_LT(longest, 120.0);
    for (const auto& r : f.pose.value) {
      EXPECT_NEAR(r.q_WS.norm(), 1.0, 1e-12);
      EXPECT_LT(r.p_W_m.norm(), 60.0);
    }
    if (!f.battery_V.empty()) {
      auto v = f.battery_V.value;
      std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
      const double cells = GetParam() == "neurobem_test" || GetParam().substr(0, 10) == "undeclared" ? 4.0 : 1.0;
      EXPECT_GT(v[v.size() / 2] / cells, 3.0);
      EXPECT_LT(v[v.size() / 2] / cells, 4.4);
    }
    for (const auto& u : f.motor_command.value)
      for (const double x : u) EXPECT_TRUE(x >= 0.0 && x <= 1.0) << x;
  }
}

TEST_P(MeasuredLogs, MedianSpecificForceAlongBodyZIsGravityInTheCalmestFlightAndAtMostFourTimesThatInTheWildest) {
  double calmest = 1e9, wildest = 0.0;
  for (const auto& file : files_) {
    const auto f = read_flight(file, &mapping_);
    if (f.accel_B_m_s2.empty()) GTEST_SKIP() << "the set has no specific force";
    auto z = component<Eigen::Vector3d>(f.accel_B_m_s2, [](const auto& a) { return a.z(); });
    std::nth_element(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2), z.end());
    calmest = std::min(calmest, z[z.size() / 2] / kGravity_m_s2);
    wildest = std::max(wildest, z[z.size() / 2] / kGravity_m_s2);
  }
  EXPECT_GT(calmest, 0.95);
  EXPECT_LT(calmest, 1.15);
  EXPECT_LT(wildest, 4.0);
}

// Attitude order, direction and axes: the specific force, turned to the world and less gravity, is the change of velocity.
TEST_P(MeasuredLogs, SpecificForceTurnedByTheAttitudeIsTheChangeOfVelocity) {
  std::size_t judged = 0;
  for (const auto& file : files_) {
    if (file.stem() == "rotation") continue;  // of undeclared_*: swings a pose sensor that sits 8 cm in front of the centre of mass
    const auto f = read_flight(file, &mapping_);
    if (f.pose.empty() || f.accel_B_m_s2.empty()) GTEST_SKIP() << "the set has no pose or no specific force";
    std::vector<double> t;
    for (double x = f.pose.t_s.front() + 1.0; x < f.pose.t_s.back() - 1.0; x += 0.01) t.push_back(x);
    const auto at = [&](const auto& stream, const auto& pick) {
      std::vector<double> v;
      for (const auto& x : stream.value) v.push_back(pick(x));
      return linear(stream.t_s, v, t);
    };
    if (t.size() < 300) continue;  // too short for the smoothing below
    // Attitudes of both signs stand for one rotation: interpolate the matrix.
    for (int axis = 0; axis < 3; ++axis) {
      const auto p = at(f.pose, [&](const PoseReading& r) { return r.p_W_m[axis]; });
      std::vector<double> force(t.size(), axis == 2 ? -kGravity_m_s2 : 0.0), accel(t.size(), 0.0);
      for (int k = 0; k < 3; ++k) {
        const auto r = at(f.pose, [&](const PoseReading& x) { return x.q_WS.toRotationMatrix()(axis, k); });
        const auto a = at(f.accel_B_m_s2, [&](const Eigen::Vector3d& x) { return x[k]; });
        for (std::size_t i = 0; i < t.size(); ++i) force[i] += r[i] * a[i];
      }
      constexpr std::size_t kHalf = 15;  // ± 0.15 s: above the noise of twice differenced millimetres
      const auto q = smooth(smooth(p, kHalf), kHalf);
      const auto g = smooth(smooth(force, kHalf), kHalf);
      for (std::size_t i = 1; i + 1 < t.size(); ++i) accel[i] = (q[i + 1] - 2 * q[i] + q[i - 1]) / 1e-4;
      const std::vector<double> a(accel.begin() + 80, accel.end() - 80), b(g.begin() + 80, g.end() - 80);
      double power = 0.0;
      for (const double x : a) power += x * x / static_cast<double>(a.size());
      if (std::sqrt(power) < 1.0) continue;  // not flown along this axis, beyond what a tilted pose sensor makes
      ++judged;
      EXPECT_GT(correlation(a, b), 0.85) << file.filename() << " axis " << axis;
    }
  }
  EXPECT_GT(judged, 0u);
}

// Rotor order and sign: rotors on the left that turn faster roll the vehicle to the right (+), those behind pitch it nose down (+).
TEST_P(MeasuredLogs, RollAndPitchFollowTheRotorsThatOurOrderNames) {
  std::vector<double> roll, pitch, yaw;
  for (const auto& file : files_) {
    const auto f = read_flight(file, &mapping_);
    if (f.gyro_B_rad_s.empty()) GTEST_SKIP() << "the set has no gyro";
    if (file.stem().string().substr(0, 4) == "jana" && std::stoi(file.stem().string().substr(4)) >= 20)
      continue;  // rotor 1's sensor fails there
    const auto& rotors = commands_only() ? f.motor_command : f.rotor_omega_rad_s;
    const auto& t = f.gyro_B_rad_s.t_s;
    const double rate = static_cast<double>(t.size() - 1) / (t.back() - t.front());
    const auto half = static_cast<std::size_t>(rate * 0.015);
    const auto compare = [&](int axis, const std::array<double, 4>& sign) {
      const auto w = smooth(component<Eigen::Vector3d>(f.gyro_B_rad_s, [&](const auto& x) { return x[axis]; }), half);
      std::vector<double> mixer(rotors.size(), 0.0);
      for (std::size_t r = 0; r < 4; ++r) {
        const auto omega = without_spikes(component<RotorValues>(rotors, [&](const auto& o) { return std::isnan(o[r]) ? 0.0 : o[r]; }));
        for (std::size_t i = 0; i < mixer.size(); ++i) mixer[i] += sign[r] * omega[i] * omega[i];
      }
      const auto u = smooth(linear(rotors.t_s, mixer, t), half);
      // Differences over 30 ms, less their mean over 0.2 s: slow trim (drag, centre of mass) is not compared.
      const auto step = static_cast<std::ptrdiff_t>(std::max<std::size_t>(1, half)), n = static_cast<std::ptrdiff_t>(w.size());
      const auto slow = smooth(u, static_cast<std::size_t>(rate * 0.1));
      std::vector<double> accel(w.size(), 0.0);
      const auto at = [](std::ptrdiff_t i) { return static_cast<std::size_t>(i); };
      for (std::ptrdiff_t i = step; i + step < n; ++i)
        accel[at(i)] = (w[at(i + step)] - w[at(i - step)]) / (t[at(i + step)] - t[at(i - step)]);
      const auto accel_slow = smooth(accel, static_cast<std::size_t>(rate * 0.1));
      // Streams of these logs are off against each other by up to 50 ms, and commands lead by the motor's lag: the shift that
      // explains most counts, whatever its sign of correlation.
      double best = 0.0;
      const auto reach = static_cast<std::ptrdiff_t>(rate * 0.08), pace = std::max<std::ptrdiff_t>(1, reach / 8);
      for (std::ptrdiff_t lead = -reach; lead <= reach; lead += pace) {
        std::vector<double> x, y;
        for (std::ptrdiff_t i = step + reach; i + step + reach < n; ++i) {
          x.push_back(accel[at(i)] - accel_slow[at(i)]);
          y.push_back(u[at(i - lead)] - slow[at(i - lead)]);
        }
        if (const double c = correlation(x, y); std::abs(c) > std::abs(best)) best = c;
      }
      return best;
    };
    roll.push_back(compare(0, {-1, 1, 1, -1}));
    pitch.push_back(compare(1, {-1, 1, -1, 1}));
    yaw.push_back(compare(2, {-1, -1, 1, 1}));
  }
  ASSERT_FALSE(roll.empty());
  // Commands say less: voltage and the motor's lag stand between, and some flights hardly turn. There the best flight decides.
  const auto judged = [&](std::vector<double> v) {
    return commands_only() ? *std::max_element(v.begin(), v.end()) : *std::min_element(v.begin(), v.end());
  };
  std::printf("%s: %zu flights, correlation of roll %.3f, pitch %.3f, yaw %.3f\n", GetParam().c_str(), roll.size(), judged(roll),
              judged(pitch), judged(yaw));
  EXPECT_GT(judged(roll), 0.3);
  EXPECT_GT(judged(pitch), 0.3);
  // The torque of acceleration hides the drag's (0.1 to 0.4 of one is what omega squared alone explains): the sign is what is held.
  EXPECT_GT(*std::max_element(yaw.begin(), yaw.end()), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Sets, MeasuredLogs, ::testing::ValuesIn(kSets), [](const auto& p) { return p.param; });

// Without data, too: every set has a vehicle file that reads, and every mapping parses.
TEST(MeasuredVehicles, EverySetHasAVehicleFileThatHoversAndAMappingThatReads) {
  const auto effects = host::read_effect_catalogue(fs::path(ROTORLOOP_SOURCE_DIR) / "effects/catalogue.toml");
  for (const auto& set : kSets) {
    EXPECT_NO_THROW(host::read_vehicle(kMeasured / (set + ".toml"), effects)) << set;
    EXPECT_NO_THROW(read_log_mapping(kMeasured / (set + ".mapping.toml"))) << set;
  }
  EXPECT_NO_THROW(read_log_mapping(kMeasured / "px4_ulog.mapping.toml"));
}

TEST(MeasuredLogsFigures, SampleCountsOfOneFlightOfEachSetAreThoseOfItsFiles) {
  const char* data = std::getenv("ROTORLOOP_DATA");
  if (!data) GTEST_SKIP() << "ROTORLOOP_DATA is not set: measured flights not read";
  const auto read = [&](const std::string& set, const std::string& file) {
    const auto m = read_log_mapping(kMeasured / (set + ".mapping.toml"));
    return read_flight(fs::path(data) / "flights" / set / file, &m);
  };
  EXPECT_EQ(read("neurobem_test", "melon_1_20210223_114138_seg3.csv").pose.size(), 11431u);
  const auto bare = read("imrc_cf21bl_bare", "eckart00.csv");
  EXPECT_EQ(bare.gyro_B_rad_s.size(), 4634u);
  EXPECT_EQ(bare.pose.size(), 926u);
  EXPECT_EQ(read("imrc_cf21bl_payload", "eckart06.csv").extra.at("payload_x[m]").size(), 4586u);
  EXPECT_EQ(read("arpl_crazyflie_sysid", "log10.csv").motor_command.size(), 50496u);
  EXPECT_EQ(read("undeclared_f", "rotation.csv").rotor_omega_rad_s.size(), 6001u);
  // 100 Hz in the file; the rotor speeds' own rate is 55 to 97 Hz.
  const auto square = read("idsia_nanodrone_cf21bl", "square_20251017_run2.csv").rotor_omega_rad_s;
  const double rate_Hz = static_cast<double>(square.size() - 1) / (square.t_s.back() - square.t_s.front());
  EXPECT_GT(rate_Hz, 55.0);
  EXPECT_LT(rate_Hz, 97.0);
}

}  // namespace
}  // namespace rotorloop::log

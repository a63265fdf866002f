// The flights of the data folder as records, for tests that need real logs before any mapping file is trusted. Columns, units and
// rotor orders are those of each set's own description. Only for tests: the product reads logs through mapping files.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bench/identify/flight_record.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::bench::testing {

inline std::filesystem::path measured_flights() {
  const char* root = std::getenv("ROTORLOOP_DATA");
  return root ? std::filesystem::path(root) / "flights" : std::filesystem::path();
}

class Columns {
 public:
  explicit Columns(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::string line;
    std::getline(in, line);
    std::vector<std::string> names = split(line);
    data_.resize(names.size());
    for (std::size_t c = 0; c < names.size(); ++c) index_[names[c]] = c;
    while (std::getline(in, line)) {
      const std::vector<std::string> cells = split(line);
      for (std::size_t c = 0; c < data_.size(); ++c) {
        char* end = nullptr;
        const char* text = c < cells.size() ? cells[c].c_str() : "";
        const double v = std::strtod(text, &end);
        data_[c].push_back(end == text ? std::numeric_limits<double>::quiet_NaN() : v);
      }
    }
  }
  std::size_t rows() const { return data_.empty() ? 0 : data_[0].size(); }
  double at(const std::string& name, std::size_t row) const { return data_[index_.at(name)][row]; }
  Eigen::Vector3d vector(const std::string& x, const std::string& y, const std::string& z, std::size_t row) const {
    return {at(x, row), at(y, row), at(z, row)};
  }
  Eigen::Quaterniond quaternion(const std::string& prefix, std::size_t row) const {
    return Eigen::Quaterniond(at(prefix + "w", row), at(prefix + "x", row), at(prefix + "y", row), at(prefix + "z", row)).normalized();
  }

 private:
  static std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> out;
    std::size_t from = 0;
    for (std::size_t i = 0; i <= line.size(); ++i) {
      if (i < line.size() && line[i] != ',' && line[i] != '\r') continue;
      out.push_back(line.substr(from, i - from));
      from = i + 1;
    }
    return out;
  }
  std::map<std::string, std::size_t> index_;
  std::vector<std::vector<double>> data_;
};

inline constexpr double kRpmToRad = 3.14159265358979323846 / 30.0;
inline constexpr double kDegree = 3.14159265358979323846 / 180.0;

inline host::VehicleModel quad(double mass_kg, double half_x_m, double half_y_m, double radius_m, double density = 1.2) {
  host::VehicleModel v;
  v.mass_kg = mass_kg;
  v.thrust.radius_m = radius_m;
  v.thrust.air_density_kg_m3 = density;
  v.rotors[0] = {{half_x_m, -half_y_m, 0.0}, -1};
  v.rotors[1] = {{-half_x_m, half_y_m, 0.0}, -1};
  v.rotors[2] = {{half_x_m, half_y_m, 0.0}, 1};
  v.rotors[3] = {{-half_x_m, -half_y_m, 0.0}, 1};
  return v;
}

struct MeasuredFlight {
  FlightRecord record;
  host::VehicleModel vehicle;
};

// Crazyflie order: 1 front right, 2 rear right, 3 rear left, 4 front left.
inline RotorValues from_crazyflie(double m1, double m2, double m3, double m4) { return {m1, m3, m4, m2}; }

inline MeasuredFlight read_imrc(const std::filesystem::path& file, double mass_kg, double radius_m) {
  MeasuredFlight f{.record = {}, .vehicle = quad(mass_kg, 0.0325, 0.0325, radius_m)};
  const Columns c(file);
  auto mocap = file;
  const Columns m(mocap.replace_filename(file.stem().string() + "_mocap.csv"));
  for (std::size_t i = 0; i < m.rows(); ++i)
    f.record.pose.add(1e-3 * m.at("timestamp_ms", i), {m.vector("locSrv.x", "locSrv.y", "locSrv.z", i), m.quaternion("locSrv.q", i)});
  for (std::size_t i = 0; i < c.rows(); ++i) {
    const double t = 1e-3 * c.at("timestamp_ms", i);
    f.record.velocity_W_m_s.add(t, c.vector("stateEstimate.vx", "stateEstimate.vy", "stateEstimate.vz", i));
    f.record.gyro_B_rad_s.add(t, kDegree * c.vector("gyro.x", "gyro.y", "gyro.z", i));
    f.record.accel_B_m_s2.add(t, host::kGravity_m_s2 * c.vector("acc.x", "acc.y", "acc.z", i));
    f.record.rotor_omega_rad_s.add(t, from_crazyflie(kRpmToRad * c.at("rpm.m1", i), kRpmToRad * c.at("rpm.m2", i),
                                                     kRpmToRad * c.at("rpm.m3", i), kRpmToRad * c.at("rpm.m4", i)));
    const double full = 65535.0;
    f.record.motor_command.add(t, from_crazyflie(c.at("pwm.m1_pwm", i) / full, c.at("pwm.m2_pwm", i) / full, c.at("pwm.m3_pwm", i) / full,
                                                 c.at("pwm.m4_pwm", i) / full));
    f.record.battery_V.add(t, 1e-3 * c.at("pm.vbatMV", i));
  }
  return f;
}

inline MeasuredFlight read_idsia(const std::filesystem::path& file) {
  MeasuredFlight f{.record = {}, .vehicle = quad(0.045, 0.0353, 0.0353, 0.0275)};
  const Columns c(file);
  for (std::size_t i = 0; i < c.rows(); ++i) {
    const double t = c.at("t", i);
    const Eigen::Quaterniond q = c.quaternion("q", i);
    f.record.pose.add(t, {c.vector("x", "y", "z", i), q});
    f.record.position_W_m.add(t, c.vector("x_mocap", "y_mocap", "z_mocap", i));
    f.record.velocity_W_m_s.add(t, c.vector("vx", "vy", "vz", i));
    f.record.gyro_B_rad_s.add(t, c.vector("wx", "wy", "wz", i));
    f.record.accel_B_m_s2.add(t, q.conjugate() * c.vector("ax", "ay", "az", i));
    const double k = kRpmToRad / 6.0;
    f.record.rotor_omega_rad_s.add(
        t, from_crazyflie(k * c.at("m1_erpm", i), k * c.at("m2_erpm", i), k * c.at("m3_erpm", i), k * c.at("m4_erpm", i)));
    f.record.battery_V.add(t, c.at("Vbat", i));
  }
  return f;
}

inline MeasuredFlight read_neurobem(const std::filesystem::path& file) {
  MeasuredFlight f{.record = {}, .vehicle = quad(0.752, 0.076, 0.10, 0.0635)};
  const Columns c(file);
  for (std::size_t i = 0; i < c.rows(); ++i) {
    const double t = c.at("t_s", i);
    const Eigen::Quaterniond q = c.quaternion("q", i);
    f.record.pose.add(t, {c.vector("px", "py", "pz", i), q});
    f.record.velocity_W_m_s.add(t, q * c.vector("vx_body", "vy_body", "vz_body", i));
    f.record.gyro_B_rad_s.add(t, c.vector("wx", "wy", "wz", i));
    f.record.accel_B_m_s2.add(t, c.vector("ax", "ay", "az", i));
    f.record.rotor_omega_rad_s.add(t, {c.at("mot2", i), c.at("mot3", i), c.at("mot4", i), c.at("mot1", i)});
    f.record.battery_V.add(t, 0.1 * c.at("vbat_x10", i));
  }
  return f;
}

inline MeasuredFlight read_undeclared(const std::filesystem::path& file) {
  MeasuredFlight f{.record = {}, .vehicle = quad(0.682, 0.0885, 0.0885, 0.0635, 1.19)};
  f.vehicle.pose_sensor_p_BS_m = {0.08, 0.0, 0.01};
  const Columns c(file);
  for (std::size_t i = 0; i < c.rows(); ++i) {
    const double t = c.at("t", i);
    f.record.pose.add(t, {c.vector("px", "py", "pz", i), c.quaternion("q", i)});
    f.record.gyro_B_rad_s.add(t, c.vector("gx", "gy", "gz", i));
    f.record.accel_B_m_s2.add(t, c.vector("ax", "ay", "az", i));
    f.record.rotor_omega_rad_s.add(t, {c.at("omega1", i), c.at("omega2", i), c.at("omega3", i), c.at("omega4", i)});
    f.record.battery_V.add(t, c.at("vbat", i));
  }
  return f;
}

inline MeasuredFlight read_nanobench(const std::filesystem::path& file) {
  MeasuredFlight f{.record = {}, .vehicle = quad(0.027, 0.0325, 0.0325, 0.023)};
  const Columns c(file);
  const double start = c.at("t", 0);
  for (std::size_t i = 0; i < c.rows(); ++i) {
    const double t = c.at("t", i) - start;
    f.record.pose.add(t, {c.vector("px", "py", "pz", i), c.quaternion("q", i)});
    f.record.velocity_W_m_s.add(t, c.vector("vx", "vy", "vz", i));
    f.record.gyro_B_rad_s.add(t, c.vector("imu_gyro_x", "imu_gyro_y", "imu_gyro_z", i));
    f.record.accel_B_m_s2.add(t, host::kGravity_m_s2 * c.vector("imu_acc_x", "imu_acc_y", "imu_acc_z", i));
    const double k = 1.0 / 65535.0;
    f.record.motor_command.add(t, from_crazyflie(k * c.at("motor_motor_m1", i), k * c.at("motor_motor_m2", i),
                                                 k * c.at("motor_motor_m3", i), k * c.at("motor_motor_m4", i)));
    f.record.battery_V.add(t, c.at("pwr_pm_vbat", i));
  }
  return f;
}

inline MeasuredFlight read_crazypad(const std::filesystem::path& file) {
  MeasuredFlight f{.record = {}, .vehicle = quad(0.030, 0.0325, 0.0325, 0.023)};
  const Columns c(file);
  for (std::size_t i = 0; i < c.rows(); ++i) {
    const double t = 1e-3 * c.at("timestamp_ms", i);
    f.record.position_W_m.add(t, c.vector("stateEstimate.x", "stateEstimate.y", "stateEstimate.z", i));
    f.record.velocity_W_m_s.add(t, c.vector("stateEstimate.vx", "stateEstimate.vy", "stateEstimate.vz", i));
    const double k = 1.0 / 65535.0;
    f.record.motor_command.add(
        t, from_crazyflie(k * c.at("motor.m1", i), k * c.at("motor.m2", i), k * c.at("motor.m3", i), k * c.at("motor.m4", i)));
    f.record.battery_V.add(t, 1e-3 * c.at("pm.vbatMV", i));
  }
  return f;
}

// Reads by the name of the set's folder.
inline MeasuredFlight read_measured(const std::filesystem::path& file) {
  const std::string set = file.parent_path().filename().string();
  MeasuredFlight f = set == "imrc_cf21bl_bare"         ? read_imrc(file, 0.037, 0.0275)
                     : set == "imrc_cf21bl_payload"    ? read_imrc(file, 0.0444, 0.0275)
                     : set == "imrc_cf21_brushed"      ? read_imrc(file, 0.0347, 0.023)
                     : set == "idsia_nanodrone_cf21bl" ? read_idsia(file)
                     : set == "neurobem_test"          ? read_neurobem(file)
                     : set == "nanobench_cf21"         ? read_nanobench(file)
                     : set == "crazypad_faults"        ? read_crazypad(file)
                                                       : read_undeclared(file);
  f.record.name = set + "/" + file.stem().string();
  f.record.source = file.filename().string();
  return f;
}

inline std::vector<std::filesystem::path> flights_of(const std::string& set) {
  std::vector<std::filesystem::path> out;
  for (const auto& e : std::filesystem::directory_iterator(measured_flights() / set)) {
    const std::string name = e.path().filename().string();
    if (e.path().extension() == ".csv" && !name.ends_with("_mocap.csv")) out.push_back(e.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace rotorloop::bench::testing

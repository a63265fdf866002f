// A flight as identification sees it: streams with their own clocks, in SI units, in this house's frames and rotor order, whoever
// logged it. Readers (own log, ULog, CSV through a mapping file) fill it; checks judge it; the estimator takes what is left.
// Frames: W world (x forward, y left, z up), B body, S pose sensor. Rotors: 1 front right, 2 rear left, 3 front left, 4 rear right.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <map>
#include <string>
#include <vector>

namespace rotorloop::log {

// Samples in time order, each with its own stamp; both vectors have the same length. A stream that the log lacks is empty.
template <class Value>
struct Stream {
  std::vector<double> t_s;   // as stamped by the log; zero is the log's own, the same for all streams of a flight
  std::vector<Value> value;  // of t_s's length

  std::size_t size() const { return t_s.size(); }
  bool empty() const { return t_s.empty(); }
  void add(double t, const Value& v) {
    t_s.push_back(t);
    value.push_back(v);
  }
};

struct PoseReading {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();           // of the sensor
  Eigen::Quaterniond q_WS = Eigen::Quaterniond::Identity();  // sensor to world, normalised
};

using RotorValues = std::array<double, 4>;  // in this house's order; not-a-number where a rotor has no reading

struct FlightRecord {
  std::string name;    // of the flight, for reports: the file's stem or the folder's name
  std::string source;  // path, as given
  Stream<PoseReading> pose;
  Stream<Eigen::Vector3d> position_W_m;    // position alone (no attitude beside it), of the sensor
  Stream<Eigen::Quaterniond> attitude_WS;  // attitude alone; beside positions it has become a part of `pose`
  Stream<Eigen::Vector3d> velocity_W_m_s;  // of the pose sensor
  Stream<Eigen::Vector3d> gyro_B_rad_s;    // body rates
  Stream<Eigen::Vector3d> accel_B_m_s2;    // specific force: +g along z in hover
  Stream<RotorValues> rotor_omega_rad_s;   // mechanical, positive, measured
  Stream<RotorValues> motor_command;       // 0 to 1, when the log has commands; meaning left to the motor model
  Stream<double> battery_V;
  std::map<std::string, Stream<double>> extra;  // further named columns that a mapping asks for, e.g. "payload_x[m]"
};

// One thing the checks found, from from_s to to_s on the log's clock: `exclude` drops the samples before any fit, `refuse` ends it, `note`
// changes nothing.
enum class FindingAction { note, exclude, refuse };
struct LogFinding {
  std::string stream;  // "rotor 3 speed", "pose", …
  std::string what;    // in words, with figures and units
  double from_s = 0.0, to_s = 0.0;
  FindingAction action = FindingAction::note;
  // A sensor or its stream is wrong. Not so: time on the ground, samples before a stream begins or after it ends.
  bool fault = false;
};

}  // namespace rotorloop::log

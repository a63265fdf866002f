#include "bench/sysid/identify/wrench_score.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "bench/sysid/identify/held_out_track.hpp"
#include "bench/sysid/log/stream_reader.hpp"
#include "bench/sysid/score/preprocess.hpp"

namespace rotorloop::identify {
namespace {

using Eigen::Vector3d;
using Rows = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Index = Eigen::Index;

constexpr double kSlowest_Hz = 100.0;  // of the samples
constexpr double kMargin_s = 0.25;     // about cuts, for the filters
constexpr double kLongestDelay_s = 0.04, kDelayStep_s = 0.0025;

// Where the fit has a place for the accelerometer, the gyro's slope takes the reading to the centre of mass: the force is scored beside
// what is asked of a predictor, the model's own angular acceleration there. Such a row stands before the last, under the flight's name and
// this.
constexpr const char* kAtAccelerometer = ", at the accelerometer";

// What belongs to a flight is not known of one that was not fitted: its usual value stands for it.
double usual(const estimate::Fit& fit, int parameter) {
  double sum = 0.0;
  for (const estimate::ModelValues& v : fit.values) sum += v[parameter];
  return sum / static_cast<double>(fit.values.size());
}
Vector3d usual_vector(const estimate::Fit& fit, int first) { return {usual(fit, first), usual(fit, first + 1), usual(fit, first + 2)}; }

void filter(Rows& x, const WrenchBand& band, double rate_Hz) {
  for (Index a = 0; a < 6; ++a) {
    std::vector<double> row(x.row(a).begin(), x.row(a).end());
    if (band.to_Hz > 0.0 && band.to_Hz < 0.5 * rate_Hz) row = score::zero_phase_low_pass(row, band.to_Hz, rate_Hz);
    if (band.from_Hz > 0.0) {
      const std::vector<double> slow = score::zero_phase_low_pass(row, band.from_Hz, rate_Hz);
      for (std::size_t k = 0; k < row.size(); ++k) row[k] -= slow[k];
    }
    for (std::size_t k = 0; k < row.size(); ++k) x(a, static_cast<Index>(k)) = row[k];
  }
}

// What makes a wrench of an acceleration, and measurements of a wrench.
struct Reference {
  double mass_kg = 0.0;
  Eigen::Matrix3d inertia_kg_m2;
  Vector3d accel_bias_m_s2, imu_m;
};

enum class Turning : unsigned char { measured, modelled };  // whose angular acceleration takes the accelerometer to the centre of mass

// Specific force and angular acceleration at each node, `late_s` later, by the measurements; times mass and inertia.
Rows measured(const log::FlightRecord& record, const score::StateTrack& track, const Reference& ref, double late_s, Turning turning) {
  log::StreamReader<Vector3d> gyro_before(record.gyro_B_rad_s), gyro_after(record.gyro_B_rad_s);
  // Four measurements within a step: what a faster sensor shows beyond half the rate of the nodes is averaged out.
  constexpr std::array kWithin{-0.375, -0.125, 0.125, 0.375};
  std::vector<log::StreamReader<Vector3d>> accel(kWithin.size(), log::StreamReader<Vector3d>(record.accel_B_m_s2));
  Rows out = Rows::Zero(6, static_cast<Index>(track.state.size()));
  for (std::size_t k = 0; k < track.state.size(); ++k) {
    const auto c = static_cast<Index>(k);
    const double t = track.time_s(k) + late_s, half = 0.5 * track.step_s;
    Vector3d slope = Vector3d::Zero();
    if (!record.gyro_B_rad_s.empty()) slope = (gyro_after.at(t + half) - gyro_before.at(t - half)) / track.step_s;
    out.col(c).tail<3>() = ref.inertia_kg_m2 * slope;
    if (record.accel_B_m_s2.empty()) continue;
    Vector3d f = -ref.accel_bias_m_s2;
    for (std::size_t i = 0; i < kWithin.size(); ++i) f += accel[i].at(t + kWithin[i] * track.step_s) / static_cast<double>(kWithin.size());
    const Vector3d& w = track.state[k].w_B_rad_s;
    if (turning == Turning::measured) f -= slope.cross(ref.imu_m);
    out.col(c).head<3>() = ref.mass_kg * (f - w.cross(w.cross(ref.imu_m)));
  }
  return out;
}

Rows modelled(const score::StateTrack& track, const estimate::RotorInput& input, const estimate::ModelValues& values, const Reference& ref,
              Turning turning) {
  const estimate::Model model(values);
  Rows out(6, static_cast<Index>(track.state.size()));
  std::size_t hint = 0;
  for (std::size_t k = 0; k < track.state.size(); ++k) {
    const double t = track.time_s(k);
    const estimate::Instant i = model.instant(track.state[k], input.at(t, hint, false), t);
    Vector3d f = i.specific_force_B_m_s2;
    if (turning == Turning::modelled) f += i.angular_acceleration_B_rad_s2.cross(ref.imu_m);
    out.col(static_cast<Index>(k)) << ref.mass_kg * f, ref.inertia_kg_m2 * i.angular_acceleration_B_rad_s2;
  }
  return out;
}

struct Sums {
  std::size_t n = 0;
  WrenchAxes error2 = WrenchAxes::Zero(), sum = WrenchAxes::Zero(), square = WrenchAxes::Zero();

  void add(const Sums& o) {
    n += o.n;
    error2 += o.error2;
    sum += o.sum;
    square += o.square;
  }
  WrenchScore score(const std::string& flight, double delay_s) const {
    WrenchScore s{.flight = flight, .samples = n, .delay_s = delay_s};
    if (n == 0) return s;
    const double count = static_cast<double>(n);
    s.rms = (error2 / count).cwiseSqrt();
    const WrenchAxes variance = square - sum.cwiseAbs2() / count;
    for (Index a = 0; a < 6; ++a) s.explained[a] = variance[a] > 0.0 ? 1.0 - error2[a] / variance[a] : 0.0;
    return s;
  }
};

Sums sums_of(const Rows& model, const Rows& reference, const std::vector<char>& counts) {
  Sums s;
  for (Index k = 0; k < model.cols(); ++k) {
    if (!counts[static_cast<std::size_t>(k)]) continue;
    ++s.n;
    s.error2 += (model.col(k) - reference.col(k)).cwiseAbs2();
    s.sum += reference.col(k);
    s.square += reference.col(k).cwiseAbs2();
  }
  return s;
}

// Nodes that the model ties on both sides and that keep their distance from cuts.
std::vector<char> scored_nodes(const estimate::GridFlight& g, const WrenchBand& band) {
  const double margin_s = std::max(kMargin_s, band.from_Hz > 0.0 ? 0.5 / band.from_Hz : 0.0);
  std::vector<char> tied(g.nodes, 1);
  for (std::size_t k = 0; k + 1 < g.nodes; ++k) {
    if (!g.linked[k]) tied[k] = tied[k + 1] = 0;
  }
  tied.front() = tied.back() = 0;
  return log::shrunk(tied, g.step_s, margin_s);
}

struct OfModel {
  std::vector<WrenchScore>&plain, &aligned;
  Sums plain_sums = {}, aligned_sums = {};
  std::vector<WrenchScore> at_accelerometer = {};

  void finish() {
    for (std::vector<WrenchScore>* scores : {&plain, &aligned})
      scores->insert(scores->end(), at_accelerometer.begin(), at_accelerometer.end());
    plain.push_back(plain_sums.score("pooled", 0.0));
    aligned.push_back(aligned_sums.score("pooled", 0.0));
  }
};

// One held-out flight with what its sensors show, moved by every delay that is looked at, to score models against.
class ScoredFlight {
 public:
  ScoredFlight(const log::FlightRecord& record, const score::StateTrack& track, const Reference& ref, const WrenchBand& band,
               const std::vector<char>& counts)
      : record_(record), track_(track), ref_(ref), band_(band), counts_(counts) {
    const auto steps = static_cast<int>(std::lround(kLongestDelay_s / kDelayStep_s));
    for (int d = -steps; d <= steps; ++d) references_.emplace_back(kDelayStep_s * d, shown(kDelayStep_s * d, Turning::measured));
  }

  void score(const estimate::RotorInput& input, const estimate::ModelValues& values, OfModel& to) const {
    const Rows model = filtered(modelled(track_, input, values, ref_, Turning::measured));
    Sums as_stamped, best;
    double best_s = 0.0, most = -1e300;
    for (const auto& [late_s, reference] : references_) {
      const Sums s = sums_of(model, reference, counts_);
      if (std::fabs(late_s) < 0.5 * kDelayStep_s) as_stamped = s;
      const double explained = s.score("", 0.0).explained.tail<3>().sum();
      if (explained > most) {
        most = explained;
        best = s;
        best_s = late_s;
      }
    }
    if (record_.gyro_B_rad_s.empty()) {
      best = as_stamped;
      best_s = 0.0;
    }
    to.plain.push_back(as_stamped.score(record_.name, 0.0));
    to.aligned.push_back(best.score(record_.name, best_s));
    to.plain_sums.add(as_stamped);
    to.aligned_sums.add(best);
    if (record_.accel_B_m_s2.empty() || ref_.imu_m.norm() == 0.0) return;
    const Rows there = filtered(modelled(track_, input, values, ref_, Turning::modelled));
    const Sums s = sums_of(there, shown(0.0, Turning::modelled), counts_);
    to.at_accelerometer.push_back(s.score(record_.name + kAtAccelerometer, 0.0));
  }

 private:
  Rows filtered(Rows rows) const {
    filter(rows, band_, 1.0 / track_.step_s);
    return rows;
  }
  Rows shown(double late_s, Turning turning) const { return filtered(measured(record_, track_, ref_, late_s, turning)); }

  const log::FlightRecord& record_;
  const score::StateTrack& track_;
  const Reference& ref_;
  const WrenchBand& band_;
  const std::vector<char>& counts_;
  std::vector<std::pair<double, Rows>> references_;
};

}  // namespace

WrenchComparison score_wrenches(const std::vector<FlightToFit>& flights, const Identification& before, const Identification& after,
                                const estimate::GridOptions& grid, const WrenchBand& band) {
  WrenchComparison out{.band = band};
  Reference ref;
  ref.mass_kg = before.start.file[estimate::kMass];
  ref.inertia_kg_m2 = before.start.file.inertia_kg_m2();
  ref.accel_bias_m_s2 = usual_vector(after.fit, estimate::kAccelBiasX);
  ref.imu_m = usual_vector(after.fit, estimate::kImuX);
  estimate::GridOptions options = grid;
  options.rate_Hz = std::max(grid.rate_Hz, kSlowest_Hz);
  OfModel old{out.before, out.before_aligned}, found{out.after, out.after_aligned};
  for (const FlightToFit& f : flights) {
    const bool force = !f.record.accel_B_m_s2.empty(), torque = !f.record.gyro_B_rad_s.empty();
    if (!force && !torque) continue;
    options.use_gyro = torque;
    estimate::GridFlight g = make_grid(f.record, options);
    cut_between_segments(g, f.segments);
    estimate::associate_poses(g, after.fit.values.front()[estimate::kPoseDelay]);
    const score::StateTrack track = held_out_track(g, after);
    const std::vector<char> counts = scored_nodes(g, band);
    if (std::find(counts.begin(), counts.end(), 1) == counts.end()) continue;
    out.force = out.force || force;
    out.torque = out.torque || torque;
    const ScoredFlight flight(f.record, track, ref, band, counts);
    estimate::RotorInput input = track.input;
    input.prepare(before.fit.values.front());
    flight.score(input, before.fit.values.front(), old);
    flight.score(track.input, after.fit.values.front(), found);
  }
  if (out.before.empty()) return out;
  old.finish();
  found.finish();
  return out;
}

}  // namespace rotorloop::identify

#include "bench/sysid/score/inertia_band.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/log/stream_reader.hpp"
#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

using Complex = std::complex<double>;
constexpr double kPi = 3.14159265358979323846;
constexpr double kRate_Hz = 250.0;          // of the common samples
constexpr double kLongestReading_s = 0.04;  // between two readings of rates: a piece ends there
constexpr double kFirstDelay_s = -0.060, kLastDelay_s = 0.060, kCoarse_s = 2e-3, kDelayStep_s = 2.5e-4;

double usual_step_s(const std::vector<double>& t_s) {
  return t_s.size() < 2 ? 0.0 : (t_s.back() - t_s.front()) / static_cast<double>(t_s.size() - 1);
}

// Rates between successive attitudes, at the middle of each interval.
log::Stream<Eigen::Vector3d> rates_of(const log::Stream<log::PoseReading>& pose, const Eigen::Quaterniond& q_BS) {
  log::Stream<Eigen::Vector3d> out;
  for (std::size_t i = 1; i < pose.size(); ++i) {
    const double dt = pose.t_s[i] - pose.t_s[i - 1];
    if (!(dt > 0.0) || dt > kLongestReading_s) continue;
    const Eigen::Vector3d turn = estimate::log_q(pose.value[i - 1].q_WS.conjugate() * pose.value[i].q_WS);
    out.add(0.5 * (pose.t_s[i] + pose.t_s[i - 1]), q_BS * turn / dt);
  }
  return out;
}

// Appends the moment at t to a piece.
void sample(BandSeries& to, const estimate::Model& model, const estimate::BodyState& x, const estimate::RotorInputSample& u, double t_s,
            const Eigen::Vector3d& rate) {
  const Eigen::Vector3d turning = x.w_B_rad_s.cross(model.values().inertia_kg_m2() * x.w_B_rad_s);
  to.torque_N_m.push_back(model.instant(x, u, t_s).torque_B_N_m - turning);
  to.rate_rad_s.push_back(rate);
}

// Fourier sums at the given frequencies of a piece without its mean under a Hann window w; or, with `slope`, of its time derivative under
// the same window, by parts and thus exact: F(w x') = iω F(w x) - F(w' x). at(k): its sample k.
template <class At>
std::vector<Complex> spectrum(std::size_t n, const std::vector<double>& f_Hz, bool slope, const At& at_sample) {
  double mean = 0.0;
  for (std::size_t k = 0; k < n; ++k) mean += at_sample(k) / static_cast<double>(n);
  const double once = 2.0 * kPi / static_cast<double>(n);
  std::vector<Complex> out;
  for (const double f : f_Hz) {
    const double w = 2.0 * kPi * f;
    const Complex turn = std::polar(1.0, -w / kRate_Hz);
    Complex at = 1.0, sum = 0.0, edge = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      const double phase = once * static_cast<double>(k), value = at_sample(k) - mean;
      sum += at * (value * (0.5 - 0.5 * std::cos(phase)));
      edge += at * (value * 0.5 * once * kRate_Hz * std::sin(phase));
      at *= turn;
    }
    out.push_back(slope ? Complex(0.0, w) * sum - edge : sum);
  }
  return out;
}

// What straight lines between readings leave of a frequency.
double between_readings(double f_Hz, double interval_s) {
  const double x = kPi * f_Hz * interval_s;
  if (x < 1e-3) return 1.0;
  const double sinc = std::sin(std::min(x, 0.9 * kPi)) / std::min(x, 0.9 * kPi);
  return sinc * sinc;
}

std::vector<double> frequencies(const InertiaBand& band) {
  std::vector<double> f_Hz;
  for (double f = 2.0 / band.segment_s;  // below, the mean leaks in
       f <= band.to_Hz + 1e-9; f += 1.0 / band.segment_s) {
    if (f >= band.from_Hz - 1e-9) f_Hz.push_back(f);
  }
  return f_Hz;
}

// One segment: the acceleration and its causes, each at every frequency.
struct Segment {
  std::vector<Complex> acceleration;
  std::vector<std::vector<Complex>> causes;
};

template <class MakeSegment>
std::vector<Segment> segments_of(std::span<const BandSeries> pieces, double segment_s, const MakeSegment& make) {
  const auto n = static_cast<std::size_t>(std::floor(segment_s * kRate_Hz));
  std::vector<Segment> out;
  for (const BandSeries& p : pieces) {
    for (std::size_t begin = 0; begin + n <= p.rate_rad_s.size(); begin += n / 2) out.push_back(make(p, begin, n));
  }
  return out;
}

// Normal equations of acceleration = Σ factor · cause(t - delay) with real factors.
struct Normal {
  Eigen::MatrixXd causes;
  Eigen::VectorXd number;
  double acceleration = 0.0;
};
Normal normal_of(const Segment& s, const std::vector<double>& f_Hz, double delay_s) {
  const auto m = static_cast<Eigen::Index>(s.causes.size());
  Normal out{Eigen::MatrixXd::Zero(m, m), Eigen::VectorXd::Zero(m), 0.0};
  for (std::size_t i = 0; i < f_Hz.size(); ++i) {
    const Complex late = std::polar(1.0, -2.0 * kPi * f_Hz[i] * delay_s);
    for (Eigen::Index a = 0; a < m; ++a) {
      const Complex cause = s.causes[static_cast<std::size_t>(a)][i];
      out.number[a] += (std::conj(cause * late) * s.acceleration[i]).real();
      for (Eigen::Index b = 0; b < m; ++b) out.causes(a, b) += (std::conj(cause) * s.causes[static_cast<std::size_t>(b)][i]).real();
    }
    out.acceleration += std::norm(s.acceleration[i]);
  }
  return out;
}

struct Regression {
  Eigen::VectorXd factor;
  Eigen::MatrixXd covariance;  // from the scatter between segments
  double explained = 0.0, delay_s = 0.0;
};

Regression regressed(const std::vector<Segment>& segments, const std::vector<double>& f_Hz, double delay_s) {
  std::vector<Normal> each;
  for (const Segment& s : segments) each.push_back(normal_of(s, f_Hz, delay_s));
  Normal all = each.front();
  for (std::size_t i = 1; i < each.size(); ++i) {
    all.causes += each[i].causes;
    all.number += each[i].number;
    all.acceleration += each[i].acceleration;
  }
  Regression out;
  out.delay_s = delay_s;
  const Eigen::MatrixXd inverse = all.causes.inverse();
  out.factor = inverse * all.number;
  out.explained = all.acceleration > 0.0 ? out.factor.dot(all.number) / all.acceleration : 0.0;
  // Each segment pulls by its causes times what the whole leaves of its acceleration; half overlapping Hann windows share a sixth of it.
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(inverse.rows(), inverse.cols());
  for (const Normal& n : each) {
    const Eigen::VectorXd pull = n.number - n.causes * out.factor;
    scatter += pull * pull.transpose();
  }
  const double count = static_cast<double>(each.size());
  if (each.size() > 1) scatter *= count / (count - 1.0);
  out.covariance = inverse * scatter * inverse;
  return out;
}

// From coarse to fine: the causes of a torque push the way that they are meant to.
Regression best_delay(const std::vector<Segment>& segments, const std::vector<double>& f_Hz, const std::optional<double>& delay_s) {
  if (delay_s) return regressed(segments, f_Hz, *delay_s);
  const auto good = [](const Regression& r) { return r.factor[0] > 0.0 ? r.explained : -1.0; };
  Regression best = regressed(segments, f_Hz, 0.0);
  const auto look = [&](double from_s, double to_s, double step_s) {
    for (double d = from_s; d <= to_s + 1e-9; d += step_s) {
      if (Regression r = regressed(segments, f_Hz, d); good(r) > good(best)) best = std::move(r);
    }
  };
  look(kFirstDelay_s, kLastDelay_s, kCoarse_s);
  look(best.delay_s - kCoarse_s, best.delay_s + kCoarse_s, kDelayStep_s);
  return best;
}

void scale(std::vector<Complex>& of, const std::vector<double>& f_Hz, double interval_s) {
  for (std::size_t i = 0; i < f_Hz.size(); ++i) of[i] /= between_readings(f_Hz[i], interval_s);
}

std::vector<Complex> acceleration_of(const BandSeries& p, std::size_t begin, std::size_t n, const std::vector<double>& f_Hz, int axis) {
  auto out = spectrum(n, f_Hz, true, [&](std::size_t k) { return p.rate_rad_s[begin + k][axis]; });
  scale(out, f_Hz, p.rate_interval_s);
  return out;
}

}  // namespace

std::vector<BandSeries> band_series(const log::FlightRecord& record, const estimate::ModelValues& values) {
  if (record.gyro_B_rad_s.empty()) {
    throw Error({record.source, "no gyro in flight " + record.name + ": inertia by bands compares torque with the gyro's slope", "",
                 "map the gyro's columns, or leave this flight out"},
                ExitCode::data_quality);
  }
  const estimate::Model model(values);
  estimate::RotorInput input(record);
  input.prepare(values);
  log::StreamReader<Eigen::Vector3d> gyro(record.gyro_B_rad_s), velocity(record.velocity_W_m_s);
  log::StreamReader<log::PoseReading> pose(record.pose);
  const bool moving = !record.velocity_W_m_s.empty() && !record.pose.empty();
  const Eigen::Quaterniond q_SB = values.q_BS().conjugate();
  const double from = std::max(record.gyro_B_rad_s.t_s.front(), input.first_s());
  const double to = std::min(record.gyro_B_rad_s.t_s.back(), input.last_s());
  BandSeries out;
  std::size_t hint = 0;
  for (std::size_t k = 0; from + static_cast<double>(k) / kRate_Hz <= to; ++k) {
    const double t = from + static_cast<double>(k) / kRate_Hz;
    estimate::BodyState x;
    if (moving) {
      x.q_WB = pose.at(t).q_WS * q_SB;
      x.v_W_m_s = velocity.at(t);
    }
    sample(out, model, x, input.at(t, hint, false), t, gyro.at(t));
  }
  return {out};
}

std::vector<BandSeries> band_series(const log::FlightRecord& record, const estimate::GridFlight& grid,
                                    const std::vector<estimate::BodyState>& states, const estimate::ModelValues& values) {
  const bool by_gyro = !grid.gyro.empty() && !record.gyro_B_rad_s.empty();
  const log::Stream<Eigen::Vector3d> turns = by_gyro ? log::Stream<Eigen::Vector3d>{} : rates_of(record.pose, values.q_BS());
  const log::Stream<Eigen::Vector3d>& rates = by_gyro ? record.gyro_B_rad_s : turns;
  std::vector<BandSeries> out;
  if (rates.size() < 2) return out;
  const estimate::Model model(values);
  estimate::RotorInput input = grid.input;
  input.prepare(values, false);
  log::StreamReader<Eigen::Vector3d> reader(rates);
  // The slope between two attitudes is itself a mean over their interval: half as much again as a straight line between readings.
  const double interval_s = (by_gyro ? 1.0 : std::sqrt(1.5)) * usual_step_s(rates.t_s);
  const auto& speed_stamps = input.from_commands() ? record.motor_command.t_s : record.rotor_omega_rad_s.t_s;
  BandSeries empty;
  empty.rate_interval_s = interval_s;
  empty.rotor_interval_s = usual_step_s(speed_stamps);
  BandSeries piece = empty;
  const auto end_piece = [&] {
    if (!piece.rate_rad_s.empty()) out.push_back(std::exchange(piece, empty));
  };
  std::size_t hint = 0, next = 0;
  const double until_s = grid.time_s(grid.nodes - 1);
  for (std::size_t k = 0; grid.start_s + static_cast<double>(k) / kRate_Hz <= until_s; ++k) {
    const double t = grid.start_s + static_cast<double>(k) / kRate_Hz;
    const auto node = std::min(static_cast<std::size_t>((t - grid.start_s) / grid.step_s), grid.nodes - 2);
    while (next < rates.size() && rates.t_s[next] < t) ++next;
    const bool read = next > 0 && next < rates.size() && rates.t_s[next] - rates.t_s[next - 1] <= kLongestReading_s;
    if (!grid.linked[node] || !read) {
      end_piece();
      continue;
    }
    sample(piece, model, states[node], input.at(t, hint, false), t, reader.at(t));
  }
  end_piece();
  return out;
}

std::optional<BandInertia> inertia_in_band(std::span<const BandSeries> pieces, const InertiaBand& band) {
  const std::vector<double> f_Hz = frequencies(band);
  const auto segments = segments_of(pieces, band.segment_s, [&](const BandSeries& p, std::size_t begin, std::size_t n) {
    Segment s{acceleration_of(p, begin, n, f_Hz, band.axis),
              {spectrum(n, f_Hz, false, [&](std::size_t k) { return p.torque_N_m[begin + k][band.axis]; })}};
    scale(s.causes.front(), f_Hz, p.rotor_interval_s);
    return s;
  });
  if (segments.empty() || f_Hz.empty()) return std::nullopt;
  const Regression r = best_delay(segments, f_Hz, band.delay_s);
  const double inertia = 1.0 / r.factor[0];
  return BandInertia{inertia, inertia * inertia * std::sqrt(r.covariance(0, 0)), r.delay_s, r.explained, static_cast<int>(segments.size())};
}

BandInertia inertia_in_band(std::span<const log::FlightRecord> flights, const estimate::ModelValues& values, const InertiaBand& band) {
  std::vector<BandSeries> pieces;
  for (const log::FlightRecord& flight : flights) {
    for (BandSeries& p : band_series(flight, values)) pieces.push_back(std::move(p));
  }
  const auto found = inertia_in_band(pieces, band);
  if (found) return *found;
  throw Error({flights.empty() ? "flights" : flights.front().source,
               fmt::format("no segment of {:.1f} s, or no frequency between {:.2f} and {:.2f} Hz (from two per segment): inertia by "
                           "bands has nothing to compare",
                           band.segment_s, band.from_Hz, band.to_Hz),
               "flights shorter than a segment, or a band narrower than 1 / segment", "shorten the segments or widen the band"},
              ExitCode::data_quality);
}

}  // namespace rotorloop::score

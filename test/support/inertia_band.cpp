#include "test/support/inertia_band.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "bench/estimate/model/model.hpp"
#include "bench/estimate/model/rotor_input.hpp"
#include "bench/log/stream_reader.hpp"
#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

using Complex = std::complex<double>;
constexpr double kPi = 3.14159265358979323846;
constexpr double kRate_Hz = 250.0;  // of the common samples

struct Samples {
  std::vector<double> torque_N_m, rate_rad_s;
};

Samples sampled(const log::FlightRecord& record, const estimate::ModelValues& values, int axis) {
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
  Samples out;
  std::size_t hint = 0;
  for (std::size_t k = 0; from + static_cast<double>(k) / kRate_Hz <= to; ++k) {
    const double t = from + static_cast<double>(k) / kRate_Hz;
    estimate::BodyState x;
    if (moving) {
      x.q_WB = pose.at(t).q_WS * q_SB;
      x.v_W_m_s = velocity.at(t);
    }
    out.torque_N_m.push_back(model.instant(x, input.at(t, hint, false), t).torque_B_N_m[axis]);
    out.rate_rad_s.push_back(gyro.at(t)[axis]);
  }
  return out;
}

// Fourier sums at the given frequencies of a piece without its mean under a Hann window w; or, with `slope`, of its time derivative under
// the same window, by parts and thus exact: F(w x') = iω F(w x) - F(w' x).
std::vector<Complex> spectrum(const std::vector<double>& x, std::size_t begin, std::size_t n, const std::vector<double>& f_Hz, bool slope) {
  double mean = 0.0;
  for (std::size_t k = 0; k < n; ++k) mean += x[begin + k] / static_cast<double>(n);
  const double once = 2.0 * kPi / static_cast<double>(n);
  std::vector<Complex> out;
  for (const double f : f_Hz) {
    const double w = 2.0 * kPi * f;
    const Complex turn = std::polar(1.0, -w / kRate_Hz);
    Complex at = 1.0, sum = 0.0, edge = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      const double phase = once * static_cast<double>(k), value = x[begin + k] - mean;
      sum += at * (value * (0.5 - 0.5 * std::cos(phase)));
      edge += at * (value * 0.5 * once * kRate_Hz * std::sin(phase));
      at *= turn;
    }
    out.push_back(slope ? Complex(0.0, w) * sum - edge : sum);
  }
  return out;
}

struct Piece {
  std::vector<Complex> torque, acceleration;
};

// acceleration = torque / J: the real factor that explains most, as numerator and denominator of 1/J.
struct Ratio {
  double number = 0.0, torque = 0.0, acceleration = 0.0;
};
Ratio ratio(const Piece& piece, const std::vector<double>& f_Hz, double delay_s) {
  Ratio r;
  for (std::size_t i = 0; i < f_Hz.size(); ++i) {
    const Complex torque = piece.torque[i] * std::polar(1.0, -2.0 * kPi * f_Hz[i] * delay_s);
    r.number += (std::conj(torque) * piece.acceleration[i]).real();
    r.torque += std::norm(torque);
    r.acceleration += std::norm(piece.acceleration[i]);
  }
  return r;
}
Ratio ratio(const std::vector<Piece>& pieces, const std::vector<double>& f_Hz, double delay_s) {
  Ratio sum;
  for (const Piece& p : pieces) {
    const Ratio r = ratio(p, f_Hz, delay_s);
    sum.number += r.number;
    sum.torque += r.torque;
    sum.acceleration += r.acceleration;
  }
  return sum;
}

}  // namespace

BandInertia inertia_in_band(std::span<const log::FlightRecord> flights, const estimate::ModelValues& values, const InertiaBand& band) {
  const auto n = static_cast<std::size_t>(std::floor(band.segment_s * kRate_Hz));
  std::vector<double> f_Hz;
  for (double f = 2.0 / band.segment_s;  // below, the mean leaks in
       f <= band.to_Hz + 1e-9; f += 1.0 / band.segment_s) {
    if (f >= band.from_Hz - 1e-9) f_Hz.push_back(f);
  }
  std::vector<Piece> pieces;
  for (const log::FlightRecord& flight : flights) {
    const Samples s = sampled(flight, values, band.axis);
    for (std::size_t begin = 0; begin + n <= s.rate_rad_s.size(); begin += n / 2) {
      pieces.push_back({spectrum(s.torque_N_m, begin, n, f_Hz, false), spectrum(s.rate_rad_s, begin, n, f_Hz, true)});
    }
  }
  if (pieces.empty() || f_Hz.empty()) {
    throw Error({flights.empty() ? "flights" : flights.front().source,
                 fmt::format("no segment of {:.1f} s, or no frequency between {:.2f} and {:.2f} Hz (from two per segment): inertia by "
                             "bands has nothing to compare",
                             band.segment_s, band.from_Hz, band.to_Hz),
                 "flights shorter than a segment, or a band narrower than 1 / segment", "shorten the segments or widen the band"},
                ExitCode::data_quality);
  }

  BandInertia out;
  out.segments = static_cast<int>(pieces.size());
  const auto explained = [&](double delay_s) {
    const Ratio r = ratio(pieces, f_Hz, delay_s);
    return r.number * r.number / (r.torque * r.acceleration);
  };
  if (band.delay_s) {
    out.delay_s = *band.delay_s;
  } else {
    out.delay_s = -0.010;
    for (double d = -0.010; d <= 0.030 + 1e-9; d += 2.5e-4) {
      if (explained(d) > explained(out.delay_s)) out.delay_s = d;
    }
  }
  out.explained = explained(out.delay_s);
  const Ratio all = ratio(pieces, f_Hz, out.delay_s);
  out.inertia_kg_m2 = all.torque / all.number;
  // Each segment pulls by its torque times what the whole leaves of its acceleration; half overlapping Hann windows share a sixth of it.
  double scatter = 0.0;
  for (const Piece& p : pieces) {
    const Ratio r = ratio(p, f_Hz, out.delay_s);
    const double pull = r.number - r.torque / out.inertia_kg_m2;
    scatter += pull * pull;
  }
  out.u_kg_m2 = std::fabs(out.inertia_kg_m2 * out.inertia_kg_m2) * std::sqrt(scatter) / all.torque;
  return out;
}

}  // namespace rotorloop::score

// Stand against flight: are two coefficients the same, different, or does the evidence not reach? A difference that is not significant is
// no proof of agreement, so two tests are made: against no difference, and against a difference of the margin (two one-sided tests,
// Schuirmann 1987).
#pragma once
#include <string>
#include <vector>

namespace rotorloop::stand {

struct Compared {
  std::string name;
  double value = 0.0, u = 0.0;  // at one density and one window
  double degrees = 1e6;
};

enum class ComparisonVerdict { different, equivalent, cannot_tell };

struct PairComparison {
  std::string a, b;
  double d = 0.0, u = 0.0, degrees = 0.0;  // ln(a/b)
  double low = 0.0, high = 0.0;            // 95 %
  double z = 0.0;                          // |d| / u
  double e_n = 0.0;                        // |d| / (2 u): at most 1 is compatible (ISO 13528)
  double needed_u = 0.0;                   // cannot_tell: u below which one of the two tests would decide
  double margin = 0.0;
  bool significant = false;  // 0 lies outside the 95 % interval
  ComparisonVerdict verdict = ComparisonVerdict::cannot_tell;
};
std::string verdict_text(const PairComparison& p);  // "different", "equivalent", "cannot tell: need u < 1.2 %"

// `shared`: relative standard uncertainty of errors that both have alike (the same scale, the same speed sensor); it cancels.
PairComparison compare_pair(const Compared& a, const Compared& b, double margin, double shared = 0.0);

// One cause that could make the difference, and what is known of it. Nothing is claimed that was not tested.
struct Attribution {
  std::string cause;
  double d = 0.0, u = 0.0;  // of ln(stand/flight) that it predicts
  bool tested = false;
  std::string note;
};

struct AttributionInputs {
  double density_u = 3e-3, mass_u = 0.0, radius_u = 0.01;  // relative
  double exponent = 2.0, exponent_u = 0.0;                 // of thrust on the stand
  double stand_centre_rad_s = 0.0, hover_rad_s = 0.0;
  double arm_width_m = 0.0, rotor_radius_m = 0.0;  // 0: not given
  double rotor_scatter = 0.0;                      // relative, of one rotor
  double zero_share = 0.0;                         // of the budget
  bool abab = false;                               // arms were behind the propeller on the stand too
};
// The rows of bench measurements that could differ; the last row is their sum.
std::vector<Attribution> attribution(const AttributionInputs& in, double observed_d);

}  // namespace rotorloop::stand

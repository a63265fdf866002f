#include "bench/render/digits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace rotorloop::render {
namespace {

constexpr int kMostDigits = 10;              // of a value: beyond them lies the rounding of what it was computed with
constexpr int kSmallest = -4, kLargest = 6;  // powers of ten that are written without an exponent

// Power of ten of the first digit, after rounding to `digits`: 0.0996 with two digits is 0.10.
int power_of(double v, int digits) {
  if (v == 0.0) return 0;
  const std::string text = fmt::format("{:.{}e}", std::fabs(v), digits - 1);
  return std::stoi(text.substr(text.find('e') + 1));
}

double rounded_to(double v, int place) {
  const double step = std::pow(10.0, place);
  return std::round(v / step) * step;
}

std::string printed(double v, int place, bool exponent) {
  if (exponent) {
    const int power = power_of(rounded_to(v, place), kMostDigits);
    return fmt::format("{:.{}e}", v, std::clamp(power - place, 0, kMostDigits));
  }
  std::string text = fmt::format("{:.{}f}", place > 0 ? rounded_to(v, place) : v, std::max(0, -place));
  if (text.starts_with('-') && text.find_first_not_of("-0.") == std::string::npos) text.erase(0, 1);  // rounded to nothing
  return text;
}

}  // namespace

MeasuredText measured(double value, double u) {
  if (!std::isfinite(value) || !std::isfinite(u) || !(u > 0.0)) return {fmt::format("{:.4g}", value), ""};
  const int own_place = power_of(u, 2) - 1;
  // A u that is rounding alone tells nothing of the value's digits: a fit of what has no scatter.
  if (value != 0.0 && power_of(value, 2) - own_place >= kMostDigits) return {fmt::format("{:.4g}", value), fmt::format("{:.1e}", u)};
  const int place = own_place;
  const int largest = std::max(power_of(value, 2), power_of(u, 2));
  const bool exponent = largest < kSmallest || largest >= kLargest;
  const bool small_u = power_of(u, 2) < kSmallest || power_of(u, 2) >= kLargest;
  const bool vanishes = rounded_to(value, place) == 0.0;
  return {vanishes && exponent ? "0" : printed(value, place, exponent),
          small_u ? fmt::format("{:.1e}", u) : printed(u, power_of(u, 2) - 1, false)};
}

std::string measured_text(double value, double u) {
  const MeasuredText t = measured(value, u);
  return t.u.empty() ? t.value : t.value + " ± " + t.u;
}

}  // namespace rotorloop::render

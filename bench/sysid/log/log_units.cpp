#include "bench/sysid/log/log_units.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>

#include "host/base/constants.hpp"

namespace rotorloop::log {
namespace {

// Exact by definition: NIST SP 811 (2008), appendix B.8; the ounce and the pound of force at standard gravity.
constexpr double kGram_N = 1e-3 * kGravity_m_s2, kPound_N = 0.45359237 * kGravity_m_s2, kInch_m = 0.0254;

constexpr std::array kUnits{
    LogUnit{"s", "s", 1.0},
    LogUnit{"ms", "s", 1e-3},
    LogUnit{"us", "s", 1e-6},
    LogUnit{"ns", "s", 1e-9},
    LogUnit{"m", "m", 1.0},
    LogUnit{"cm", "m", 1e-2},
    LogUnit{"mm", "m", 1e-3},
    LogUnit{"m/s", "m/s", 1.0},
    LogUnit{"cm/s", "m/s", 1e-2},
    LogUnit{"mm/s", "m/s", 1e-3},
    LogUnit{"m/s2", "m/s2", 1.0},
    LogUnit{"g", "m/s2", kGravity_m_s2},
    LogUnit{"mg", "m/s2", 1e-3 * kGravity_m_s2},
    LogUnit{"rad/s", "rad/s", 1.0},
    LogUnit{"mrad/s", "rad/s", 1e-3},
    LogUnit{"deg/s", "rad/s", kRad_per_deg},
    LogUnit{"rpm", "rad/s", kRad_s_per_rpm},
    LogUnit{"Hz", "rad/s", 2.0 * std::numbers::pi},  // turns a second
    LogUnit{"erpm", "rad/s", kRad_s_per_rpm, true},
    LogUnit{"rad", "rad", 1.0},
    LogUnit{"deg", "rad", kRad_per_deg},
    LogUnit{"V", "V", 1.0},
    LogUnit{"dV", "V", 0.1},
    LogUnit{"cV", "V", 1e-2},
    LogUnit{"mV", "V", 1e-3},
    LogUnit{"A", "A", 1.0},
    LogUnit{"mA", "A", 1e-3},
    LogUnit{"N", "N", 1.0},
    LogUnit{"mN", "N", 1e-3},
    LogUnit{"kN", "N", 1e3},
    LogUnit{"gf", "N", kGram_N},
    LogUnit{"kgf", "N", kGravity_m_s2},
    LogUnit{"lbf", "N", kPound_N},
    LogUnit{"ozf", "N", kPound_N / 16.0},
    LogUnit{"N m", "N m", 1.0},
    LogUnit{"N cm", "N m", 1e-2},
    LogUnit{"N mm", "N m", 1e-3},
    LogUnit{"mN m", "N m", 1e-3},
    LogUnit{"kgf m", "N m", kGravity_m_s2},
    LogUnit{"kgf cm", "N m", 1e-2 * kGravity_m_s2},
    LogUnit{"gf cm", "N m", 1e-2 * kGram_N},
    LogUnit{"lbf ft", "N m", kPound_N * 12.0 * kInch_m},
    LogUnit{"lbf in", "N m", kPound_N* kInch_m},
    LogUnit{"ozf in", "N m", kPound_N / 16.0 * kInch_m},
    LogUnit{"1", "1", 1.0},
    LogUnit{"%", "1", 1e-2},
};

// Small letters and digits alone: dots, signs of multiplication and blanks between factors are written in many ways and encodings. A micro
// sign is the letter u; what else is not ASCII stays, and makes the unit an unknown one.
std::string plain(std::string_view written) {
  std::string out;
  for (std::size_t i = 0; i < written.size();) {
    const auto rest = written.substr(i);
    const auto take = [&](std::string_view sign, const char* as) {
      if (!rest.starts_with(sign)) return false;
      out += as;
      i += sign.size();
      return true;
    };
    if (take("\xC2\xB7", "") || take("\xE2\x8B\x85", "") || take("\xE2\x88\x99", "") || take("\xE2\x80\xA2", "") || take("\xC3\x97", "") ||
        take("\xC2\xB5", "u") || take("\xCE\xBC", "u") || take("\xB7", "") || take("\xB5", "u"))
      continue;
    const auto c = static_cast<unsigned char>(written[i++]);
    if (c != ' ' && c != '.' && c != '*' && c != '-' && c != '_') out += static_cast<char>(std::tolower(c));
  }
  return out;
}

struct Spelling {
  std::string_view written, unit;
};
constexpr std::array kSpellings{
    Spelling{"g", "gf"},           Spelling{"kg", "kgf"},       Spelling{"kp", "kgf"},       Spelling{"lb", "lbf"},
    Spelling{"lbs", "lbf"},        Spelling{"oz", "ozf"},       Spelling{"kgcm", "kgf cm"},  Spelling{"kgm", "kgf m"},
    Spelling{"gcm", "gf cm"},      Spelling{"lbft", "lbf ft"},  Spelling{"ftlb", "lbf ft"},  Spelling{"ftlbf", "lbf ft"},
    Spelling{"lbin", "lbf in"},    Spelling{"inlb", "lbf in"},  Spelling{"inlbf", "lbf in"}, Spelling{"ozin", "ozf in"},
    Spelling{"inoz", "ozf in"},    Spelling{"inozf", "ozf in"}, Spelling{"rev/s", "Hz"},     Spelling{"rps", "Hz"},
    Spelling{"1/s", "Hz"},         Spelling{"1/min", "rpm"},    Spelling{"rev/min", "rpm"},  Spelling{"m/s^2", "m/s2"},
    Spelling{"radians/s", "rad/s"}};

}  // namespace

std::span<const LogUnit> log_units() { return kUnits; }

const LogUnit* find_log_unit(std::string_view name) {
  const auto it = std::find_if(kUnits.begin(), kUnits.end(), [&](const LogUnit& u) { return u.name == name; });
  return it == kUnits.end() ? nullptr : &*it;
}

const LogUnit* find_written_unit(std::string_view written, std::string_view si) {
  std::string wanted = plain(written);
  for (const Spelling& s : kSpellings)
    if (s.written == wanted && find_log_unit(s.unit)->si == si) wanted = plain(s.unit);
  for (const LogUnit& u : kUnits)
    if (u.si == si && plain(u.name) == wanted) return &u;
  return nullptr;
}

std::string log_units_of(std::string_view si) {
  std::string names;
  for (const auto& u : kUnits)
    if (u.si == si) names += (names.empty() ? "" : ", ") + std::string(u.name);
  return names;
}

}  // namespace rotorloop::log

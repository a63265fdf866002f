#include "host/base/nearest.hpp"

#include <algorithm>
#include <array>
#include <numeric>

namespace rotorloop {
namespace {

std::string folded(std::string_view word) {
  std::string out(word);
  for (char& c : out) c = c == '-' ? '_' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return out;
}

std::vector<std::string> parts_of(std::string_view key) {
  std::vector<std::string> out(1);
  for (const char c : key) {
    if (c == '_')
      out.emplace_back();
    else
      out.back() += c;
  }
  return out;
}

// Units as keys end with; a key without one is dimensionless or a word.
bool is_unit(std::string_view part) {
  constexpr std::array<std::string_view, 34> kUnits{"m",   "mm", "cm",  "km",  "g",   "kg", "s", "ms", "us",      "min",  "h", "rad",
                                                    "deg", "N",  "mN",  "Nm",  "V",   "mV", "A", "mA", "Ohm",     "mOhm", "H", "uH",
                                                    "Wb",  "Hz", "kHz", "rpm", "RPM", "Pa", "K", "C",  "percent", "m2"};
  return std::find(kUnits.begin(), kUnits.end(), part) != kUnits.end();
}

// One part of a key for another: long enough to be a word, and not two words of a family (xx for yy, 1 for 2, min for max).
bool slip_of_part(const std::string& given, const std::string& wanted) {
  const std::size_t allowed = wanted.size() >= 8 ? 2 : wanted.size() >= 4 ? 1 : 0;
  if (allowed == 0 || edit_distance(folded(given), folded(wanted)) > allowed) return false;
  const auto family = [](char c) { return (c >= '0' && c <= '9') || (c >= 'x' && c <= 'z'); };
  if (given.size() != wanted.size()) return true;
  for (std::size_t i = 0; i < given.size(); ++i)
    if (given[i] != wanted[i] && !(family(given[i]) && family(wanted[i]))) return true;
  return false;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, row(b.size() + 1), next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    next[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      next[j] = std::min({row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) next[j] = std::min(next[j], before[j - 2] + 1);
    }
    before = row;
    std::swap(row, next);
  }
  return row.back();
}

std::string nearest(std::string_view word, const std::vector<std::string>& allowed) {
  const std::string given = folded(word);
  std::string best;
  std::size_t least = std::string::npos;
  for (const std::string& candidate : allowed) {
    const std::string meant = folded(candidate);
    const bool without_unit = given.size() >= 3 && meant.starts_with(given + "_");
    const std::size_t distance = without_unit ? std::size_t{1} : edit_distance(given, meant);
    if (distance < least && (without_unit || distance <= std::max(given.size(), meant.size()) / 3)) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& allowed) {
  const std::string best = nearest(word, allowed);
  return best.empty() ? best : "did you mean \"" + best + "\"? ";
}

bool slip_of_key(std::string_view given, std::string_view wanted) {
  if (folded(given) == folded(wanted)) return true;
  const auto a = parts_of(given), b = parts_of(wanted);
  const auto stem = b.begin() + static_cast<std::ptrdiff_t>(b.size()) - 1;
  if (b.size() > 1 && is_unit(b.back()) && std::string_view(wanted).size() - b.back().size() > 3) {
    if (std::equal(a.begin(), a.end(), b.begin(), stem)) return true;  // without its unit
    if (a.size() == b.size() && is_unit(a.back()) && std::equal(a.begin(), a.end() - 1, b.begin())) return true;
  }
  if (a.size() != b.size()) return a.size() + 1 == b.size() && edit_distance(given, wanted) == 1 && wanted.size() >= 6;  // an '_' left out
  int slips = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i]) continue;
    if (!slip_of_part(a[i], b[i])) return false;
    ++slips;
  }
  return slips == 1;
}

}  // namespace rotorloop

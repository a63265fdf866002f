#include "bench/stand/instruments/probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/base/toml_file.hpp"

namespace rotorloop::modbus {
namespace {

struct Reading {
  double mean = 0.0, noise = 0.0;
  bool finite = true;
};

// Whether a word is the same in every read, with and without load.
bool never_changes(const ProbeReadings& r, std::size_t at) {
  for (const auto* rows : {&r.zero, &r.loaded})
    for (const auto& row : *rows)
      if (row[at] != r.zero.front()[at]) return false;
  return true;
}

Reading read_as(const std::vector<std::vector<std::uint16_t>>& rows, std::size_t at, WordType type, WordOrder order) {
  Reading r;
  std::vector<double> values;
  for (const auto& row : rows) values.push_back(to_number(assemble(std::span(row).subspan(at, register_count(type)), order), type));
  for (const double v : values) r.mean += v / static_cast<double>(values.size());
  for (const double v : values) {
    r.noise = std::max(r.noise, std::abs(v - r.mean));
    r.finite = r.finite && std::isfinite(v);
  }
  return r;
}

// Scales are chosen by people: 1, 2 or 5 times a power of ten.
double round_number(double scale, double tolerance) {
  const double magnitude = std::pow(10.0, std::floor(std::log10(std::abs(scale))));
  for (const double step : {1.0, 2.0, 5.0, 10.0})
    if (std::abs(std::abs(scale) / (step * magnitude) - 1.0) <= tolerance) return std::copysign(step * magnitude, scale);
  return 0.0;
}

constexpr double kLeastChangeOverNoise = 3.0;

// Weights order what is plausible; the person decides.
double score(const ProbeCandidate& c, const ProbeReadings& r, double tolerance) {
  const double change = std::abs(c.loaded - c.zero);
  double s = std::log10(change / std::max(c.noise, 1e-3 * change));  // lies still; stiller than 1 : 1000 says no more
  if (c.round_scale != 0.0)
    s += 4.0 * (1.0 - 0.8 * std::abs(c.scale / c.round_scale - 1.0) / tolerance);  // the closer, the less it is chance
  if (c.round_scale > 0.0 && std::abs(std::log10(c.round_scale) - std::round(std::log10(c.round_scale))) < 1e-6)
    s += 1.0;                                                                         // a power of ten
  if (std::abs(c.zero) < change) s += 1.0;                                            // zero is near zero
  if (c.type == WordType::f32 && c.round_scale == 1.0) s += 2.0;                      // a float in its own unit
  if (change < 20.0 && c.type != WordType::f32 && c.type != WordType::f64) s -= 2.0;  // a flag or a counter, no measurement
  if (c.type == WordType::s16 || c.type == WordType::s32) s += 0.2;                   // of two that agree, the one that can become negative
  if (register_count(c.type) == 2) s += 0.1;                                          // and the one with room
  if (register_count(c.type) == 4) s -= 1.0;                                          // seldom
  const bool floating = c.type == WordType::f32 || c.type == WordType::f64;
  for (std::size_t i = 0; floating && i < register_count(c.type);
       ++i)  // all words of a float move: else it is the upper half of one, with a stranger
    if (never_changes(r, static_cast<std::size_t>(c.address - r.address) + i)) s -= 2.0;
  return s;
}

}  // namespace

std::vector<ProbeCandidate> rank_candidates(const ProbeReadings& r, double load, double tolerance) {
  std::vector<ProbeCandidate> all;
  const std::size_t words = r.zero.empty() || r.loaded.empty() ? 0 : std::min(r.zero.front().size(), r.loaded.front().size());
  for (const WordType type : {WordType::u16, WordType::s16, WordType::u32, WordType::s32, WordType::f32, WordType::u64, WordType::f64})
    for (const WordOrder order : {WordOrder::ABCD, WordOrder::CDAB, WordOrder::BADC, WordOrder::DCBA}) {
      if (register_count(type) == 1 && (order == WordOrder::CDAB || order == WordOrder::DCBA)) continue;  // same bytes as the other two
      for (std::size_t at = 0; at + register_count(type) <= words; ++at) {
        const Reading zero = read_as(r.zero, at, type, order), loaded = read_as(r.loaded, at, type, order);
        const double change = loaded.mean - zero.mean, noise = std::max(zero.noise, loaded.noise);
        if (!zero.finite || !loaded.finite || change == 0.0 || std::abs(change) < kLeastChangeOverNoise * noise) continue;
        if (std::abs(change) < 1e-9 || std::abs(change) > 1e15) continue;  // bits of something else, read as a float
        ProbeCandidate c{static_cast<std::uint16_t>(r.address + at), type, order, zero.mean, loaded.mean, noise, load / change, 0.0, 0.0};
        c.round_scale = round_number(c.scale, tolerance);
        c.score = score(c, r, tolerance);
        all.push_back(c);
      }
    }
  std::stable_sort(all.begin(), all.end(), [](const ProbeCandidate& a, const ProbeCandidate& b) { return a.score > b.score; });
  return all;
}

std::string channel_text(const ProbeCandidate& c, const std::string& name, const std::string& quantity, const std::string& unit, int fc,
                         const std::string& source) {
  std::string text = fmt::format("[[channel]]\nname = \"{}\"\nquantity = \"{}\"\nunit = \"{}\"\nfc = {}\naddr = {}\ntype = \"{}\"\n", name,
                                 quantity, unit, fc, c.address, modbus::name(c.type));
  if (c.order != WordOrder::ABCD) text += fmt::format("word_order = \"{}\"\n", modbus::name(c.order));
  return text + fmt::format("scale = {}\nsource = \"{}\"\n", number_text(c.round_scale != 0.0 ? c.round_scale : c.scale), source);
}

}  // namespace rotorloop::modbus

#include "bench/stand/instruments/signals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>

#include "host/base/error.hpp"

namespace rotorloop::modbus {
namespace {

std::optional<double> signal_number(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\r')) text.remove_suffix(1);
  double v = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(v)) return std::nullopt;
  return v;
}

std::vector<std::string> cells(const std::string& line, char separator) {
  std::vector<std::string> out;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t end = line.find(separator, begin);
    std::string cell = line.substr(begin, end == std::string::npos ? end : end - begin);
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    while (!cell.empty() && cell.front() == ' ') cell.erase(0, 1);
    out.push_back(cell);
    if (end == std::string::npos) return out;
    begin = end + 1;
  }
}

void put_name(Signal& s, const std::string& name) {
  const auto dot = name.find('.');
  s.device = dot == std::string::npos ? "" : name.substr(0, dot);
  s.channel = dot == std::string::npos ? name : name.substr(dot + 1);
}

// Name and numbers of "name=a,b,c".
std::pair<std::string, std::vector<double>> assignment(const std::string& text, const std::string& option, std::size_t count,
                                                       const char* form) {
  const auto equals = text.find('=');
  std::vector<double> numbers;
  bool good = equals != std::string::npos && equals > 0;
  if (good)
    for (const std::string& cell : cells(text.substr(equals + 1), ',')) {
      const auto v = signal_number(cell);
      good = good && v;
      numbers.push_back(v.value_or(0.0));
    }
  if (!good || numbers.size() != count)
    throw Error({option, fmt::format("\"{}\" is no {}", text, form), "",
                 fmt::format("write it as {}, such as net=2.5{}", form, count == 3 ? ",0.5,10" : "")});
  return {text.substr(0, equals), numbers};
}

}  // namespace

double Signal::at(double t_s) const {
  if (time_s.empty()) return mean + (amplitude == 0.0 ? 0.0 : amplitude * std::sin(6.283185307179586 * t_s / period_s));
  const double span = time_s.back() - time_s.front();
  const double t = span > 0.0 ? time_s.front() + std::fmod(std::max(0.0, t_s), span) : time_s.front();
  const auto after = std::upper_bound(time_s.begin(), time_s.end(), t);
  if (after == time_s.begin()) return value.front();
  if (after == time_s.end()) return value.back();
  const auto i = static_cast<std::size_t>(after - time_s.begin());
  return value[i - 1] + (value[i] - value[i - 1]) * (t - time_s[i - 1]) / (time_s[i] - time_s[i - 1]);
}

Signal constant_signal(const std::string& text, const std::string& option) {
  const auto [name, v] = assignment(text, option, 1, "CHANNEL=VALUE");
  Signal s;
  put_name(s, name);
  s.mean = v[0];
  return s;
}

Signal sine_signal(const std::string& text, const std::string& option) {
  const auto [name, v] = assignment(text, option, 3, "CHANNEL=MEAN,AMPLITUDE,PERIOD_S");
  if (v[2] <= 0.0) throw Error({option, fmt::format("\"{}\" has a period of {} s", text, v[2]), "", "give a period above 0 s"});
  Signal s;
  put_name(s, name);
  s.mean = v[0];
  s.amplitude = v[1];
  s.period_s = v[2];
  return s;
}

std::vector<Signal> table_signals(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string line;
  if (!in || !std::getline(in, line))
    throw Error({path.generic_string(), "cannot be read, or is empty", "", "give a CSV file: t_s, then one column for each channel"});
  const auto names = cells(line, ',');
  if (names.size() < 2 || names[0] != "t_s")
    throw Error({path.generic_string() + ":1", fmt::format("the first row is \"{}\"", line), "",
                 "begin with the names of the columns: t_s, then channels"});
  std::vector<Signal> out(names.size() - 1);
  for (std::size_t i = 0; i < out.size(); ++i) put_name(out[i], names[i + 1]);
  for (std::size_t row = 2; std::getline(in, line); ++row) {
    if (line.empty() || line == "\r") continue;
    const auto texts = cells(line, ',');
    std::vector<double> v;
    for (const std::string& t : texts)
      if (const auto number = signal_number(t)) v.push_back(*number);
    if (v.size() != names.size() || texts.size() != names.size())
      throw Error({fmt::format("{}:{}", path.generic_string(), row),
                   fmt::format("{} numbers, the header has {} columns", v.size(), names.size()), "", "give a number in each column"});
    if (!out[0].time_s.empty() && v[0] <= out[0].time_s.back())
      throw Error(
          {fmt::format("{}:{}", path.generic_string(), row), fmt::format("t_s = {} does not rise", v[0]), "", "sort the rows by time"});
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].time_s.push_back(v[0]);
      out[i].value.push_back(v[i + 1]);
    }
  }
  if (out[0].time_s.empty()) throw Error({path.generic_string(), "has no rows", "", "give at least one row of values"});
  return out;
}

}  // namespace rotorloop::modbus

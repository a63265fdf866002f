// Figures in and out of the value tree of a result (result.json): what is no number is null.
#pragma once
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace rotorloop::identify {

inline nlohmann::ordered_json number(double v) { return std::isfinite(v) ? nlohmann::ordered_json(v) : nlohmann::ordered_json(nullptr); }
inline std::string text_of(const nlohmann::ordered_json& j) { return j.get<std::string>(); }
inline double value_of(const nlohmann::ordered_json& j) {
  return j.is_number() ? j.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

template <class List, class Write>
nlohmann::ordered_json array_of(const List& list, Write&& write) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const auto& item : list) out.push_back(write(item));
  return out;
}

}  // namespace rotorloop::identify

#include "bench/sysid/log/csv_cells.hpp"

#include <string>

namespace rotorloop::log {

std::optional<double> csv_number(std::string_view text) {
  if (text.empty() || text == "null" || text == "NULL" || text == "NA" || text == "None") return kBlankCell;
  if (text == "true" || text == "True") return 1.0;
  if (text == "false" || text == "False") return 0.0;
  if (text.front() == '+') text.remove_prefix(1);
  double v = 0.0;
  const auto [used, ec] = std::from_chars(text.data(), text.data() + text.size(), v);
  if (used != text.data() + text.size()) return std::nullopt;
  if (ec == std::errc::result_out_of_range) return kBlankCell;  // 1e999: no reading that anyone has taken
  if (ec != std::errc{}) return std::nullopt;
  return v - v == 0.0 ? v : kBlankCell;
}

std::optional<double> csv_number_with_comma(std::string_view text, char separator) {
  if (const auto v = csv_number(text)) return v;
  const auto comma = text.find(',');
  if (comma == std::string_view::npos || comma != text.rfind(',') || text.find('.') != std::string_view::npos) return std::nullopt;
  if (separator == ',') {
    const auto whole = text.substr(0, comma), behind = text.substr(comma + 1);
    const auto digits = behind.substr(0, behind.find_first_not_of("0123456789"));
    if (digits.size() == 3 && whole != "0" && whole != "-0" && whole != "+0") return std::nullopt;
  }
  std::string with_point(text);
  with_point[comma] = '.';
  return csv_number(with_point);
}

}  // namespace rotorloop::log

// The limits of a stand file while a motor turns: which value has been beyond its limit for longer than its debounce.
#pragma once
#include <map>
#include <optional>
#include <string>

#include "bench/stand/instruments/stand_setup.hpp"

namespace rotorloop::stand_run {

struct Trip {
  std::string limit;   // key of the stand file, or what else stopped the run
  std::string source;  // who said the value: "thrust", "ESC", a channel
  double value = 0.0, max = 0.0;
  modbus::LimitAction action = modbus::LimitAction::cut;
  std::int64_t at_ns = 0;
};
std::string text(const Trip& trip);
std::string_view name(modbus::LimitAction action);

class LimitMonitor {
 public:
  explicit LimitMonitor(std::map<std::string, modbus::StandLimit> limits) : limits_(std::move(limits)) {}
  // A new value for a limit from one source. A trip when it has been beyond the limit, in every value since, for the debounce; said once
  // for each time it goes beyond. A value that is no number counts as beyond: nobody knows where it is.
  std::optional<Trip> see(const std::string& limit, const std::string& source, double value, std::int64_t now_ns);
  // Of the source that is nearest to the limit now; nothing before the first value.
  struct Nearest {
    std::string source;
    double value = 0.0;
  };
  std::optional<Nearest> nearest(const std::string& limit) const;
  const std::map<std::string, modbus::StandLimit>& limits() const { return limits_; }
  const modbus::StandLimit& limit(const std::string& key) const { return limits_.at(key); }

 private:
  struct Beyond {
    std::int64_t since_ns = 0;
    bool told = false;
  };
  std::map<std::string, modbus::StandLimit> limits_;
  std::map<std::pair<std::string, std::string>, Beyond> beyond_;
  std::map<std::pair<std::string, std::string>, double> newest_;
};

}  // namespace rotorloop::stand_run

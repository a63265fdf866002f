// Values of an emulated device over time: constant, sine, or columns of a file.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace rotorloop::modbus {

struct Signal {
  std::string device, channel;  // device "": the only one
  double mean = 0.0, amplitude = 0.0, period_s = 1.0;
  std::vector<double> time_s, value;  // a table instead: linear between its rows, from the start again after its end
  double at(double t_s) const;
};

// "net=2.5", "thrust.net=2.5". Throws Error (usage) with `option` as its place.
Signal constant_signal(const std::string& text, const std::string& option);
// "net=MEAN,AMPLITUDE,PERIOD_S"
Signal sine_signal(const std::string& text, const std::string& option);
// CSV with a row of names: t_s, then channels. Throws Error with line.
std::vector<Signal> table_signals(const std::filesystem::path& path);

}  // namespace rotorloop::modbus

#include "host/bus/bus_recorder.hpp"

namespace rotorloop {

BusRecorder::BusRecorder(const std::string& path, const std::string& interface) : writer_(make(path, interface)) {}

BusRecorder::Writer BusRecorder::make(const std::string& path, const std::string& interface) {
  if (path.ends_with(".pcap")) return Writer(std::in_place_type<PcapWriter>, path);
  return Writer(std::in_place_type<CandumpWriter>, path, interface);
}

}  // namespace rotorloop

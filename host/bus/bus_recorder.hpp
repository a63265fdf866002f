// Records a bus to a file, in the format that the file's ending names: .pcap (Wireshark), else the text of `candump -L`.
#pragma once
#include <cstdint>
#include <string>
#include <variant>

#include "host/bus/bus_frame.hpp"
#include "host/bus/candump_log.hpp"
#include "host/bus/pcap_log.hpp"

namespace rotorloop {

class BusRecorder {
 public:
  // `interface` names the bus in a candump log. Throws Error when the file cannot be created.
  BusRecorder(const std::string& path, const std::string& interface);
  void write(std::int64_t time_ns, const BusFrame& frame) {
    std::visit([&](auto& writer) { writer.write(time_ns, frame); }, writer_);
  }
  void close() {  // throws Error when the disk refused
    std::visit([](auto& writer) { writer.close(); }, writer_);
  }

 private:
  using Writer = std::variant<CandumpWriter, PcapWriter>;
  static Writer make(const std::string& path, const std::string& interface);
  Writer writer_;
};

}  // namespace rotorloop

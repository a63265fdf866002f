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
  // On disk within a second of traffic: a program that is killed leaves what it has heard until then.
  void write(std::int64_t time_ns, const BusFrame& frame) {
    const bool due = time_ns - flushed_ns_ >= kFlush_ns;
    if (due) flushed_ns_ = time_ns;
    std::visit(
        [&](auto& writer) {
          writer.write(time_ns, frame);
          due ? writer.flush() : void();
        },
        writer_);
  }
  void close() {  // throws Error when the disk refused
    std::visit([](auto& writer) { writer.close(); }, writer_);
  }

 private:
  using Writer = std::variant<CandumpWriter, PcapWriter>;
  static Writer make(const std::string& path, const std::string& interface);
  static constexpr std::int64_t kFlush_ns = 1'000'000'000;
  Writer writer_;
  std::int64_t flushed_ns_ = 0;
};

}  // namespace rotorloop

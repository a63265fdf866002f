// Reads the whole file at once: a minute of a full 1 Mbit/s bus is below 30 MB of text.
#include "host/bus/bus_log.hpp"

#include <fstream>
#include <iterator>
#include <utility>

#include "host/base/error.hpp"
#include "host/base/utf8.hpp"
#include "host/bus/candump_log.hpp"
#include "host/bus/foreign_bus_log.hpp"
#include "host/bus/pcap_log.hpp"

namespace rotorloop {

BusLog read_bus_log(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file.is_open() || file.bad()) {
    throw Error({.where = path,
                 .what = "cannot read the bus log",
                 .likely = "no such file; the name of a bus has a colon, as mcast:0",
                 .remedy = "check the path and the permissions of the file"});
  }
  if (looks_like_pcap(bytes)) return parse_pcap(bytes, path);
  bytes = as_utf8(std::move(bytes));  // PowerShell's ">" writes UTF-16
  if (looks_like_trc(bytes)) return parse_trc(bytes, path);
  return looks_like_asc(bytes) ? parse_asc(bytes, path) : parse_candump(bytes, path);
}

}  // namespace rotorloop

// Emulated candleLight adapters for this machine's kernel, until the end of standard input. A line of it is a command:
//   plug SERIAL CHANNELS INTERFACE    unplug SERIAL    bus-off SERIAL CHANNEL    overflow SERIAL    lose-echoes SERIAL COUNT
//   stall-out SERIAL COUNT            stall-in SERIAL COUNT
// and each is answered by "done" or "refused". usage: vm_candlelight [--unpaced] [--apart]
// --apart: first channels are on one bus, second ones on another
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "test/vm/usbip_server.hpp"

namespace {

using rotorloop::emulated::CandlelightOptions;
using rotorloop::emulated::EmulatedCandlelight;
using rotorloop::emulated::UsbIpServer;

bool obeyed(UsbIpServer& server, const std::string& line) {
  std::istringstream words(line);
  std::string command, serial;
  unsigned number = 0, interface = 0;
  words >> command >> serial >> number >> interface;
  if (command == "plug") {
    CandlelightOptions options;
    options.serial = serial;
    options.channels = number;
    options.interface = static_cast<std::uint8_t>(interface);
    return server.plug(options);
  }
  if (command == "unplug") return server.unplug(serial);
  EmulatedCandlelight* const adapter = server.adapter(serial);
  if (adapter == nullptr) return false;
  const int count = static_cast<int>(number);
  if (command == "bus-off" && number < adapter->options().channels) {
    adapter->controller(number).count_errors(256, 0);
  } else if (command == "overflow") {
    adapter->faults.overflows = 1;
  } else if (command == "lose-echoes") {
    adapter->faults.lost_echoes = count;
  } else if (command == "stall-out") {
    adapter->faults.stalled_out = count;
  } else if (command == "stall-in") {
    adapter->faults.stalled_in = count;
  } else {
    return false;
  }
  return true;
}

}  // namespace

int main(int count, char** words) {
  std::signal(SIGPIPE, SIG_IGN);
  std::ios::sync_with_stdio(false);  // so that in_avail() knows of lines that came with the one before
  const std::vector<std::string> options(words + 1, words + count);
  const auto has = [&](const char* option) { return std::find(options.begin(), options.end(), option) != options.end(); };
  UsbIpServer server(!has("--unpaced"), has("--apart") ? 2 : 1);
  while (true) {
    server.serve(0);
    std::string line;
    if (!std::getline(std::cin, line)) return 0;
    do {
      std::puts(obeyed(server, line) ? "done" : "refused");
    } while (std::cin.rdbuf()->in_avail() > 0 && std::getline(std::cin, line));
    std::fflush(stdout);
  }
}

// Master and emulated device on real ports of this machine, and libmodbus at the other end of each. No limit is on time: a hang would be
// the test's time-out.
#include <gtest/gtest.h>
#include <modbus/modbus.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "bench/stand/instruments/poller.hpp"
#include "bench/stand/instruments/port_clock.hpp"
#include "bench/stand/instruments/port_link.hpp"
#include "bench/stand/instruments/port_server.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::modbus {
namespace {

// Its device may take 10 s: a machine under load holds threads up, and how fast they are is not judged here.
Profile port_profile(const std::string& file) {
  Profile p = read_profile(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices" / (file + ".toml"));
  p.timeout_ms = p.late_max_ms = 10'000.0;
  p.byte_timeout_ms = 1'000.0;
  return p;
}

constexpr std::int64_t kFarAway = std::int64_t{1} << 62;

// Serves in a thread of its own until it goes.
struct Serving {
  Serving(std::unique_ptr<PortServer> s, std::vector<ServedDevice> devices)
      : server(std::move(s)), thread([this, devices] { server->serve(devices, stop, kFarAway); }) {}
  ~Serving() {
    stop = true;
    thread.join();
  }
  std::atomic<bool> stop{false};
  std::unique_ptr<PortServer> server;
  std::thread thread;
};

// The newest value of a channel after `steps` exchanges of our master at `port`.
std::map<std::string, double> read_all(const std::string& port, const Profile& p, std::uint8_t slave, int steps) {
  const PortName name = parse_port(port, "test");
  const SerialFormat format = serial_format(p, name.tcp ? 0 : 115200);
  PortLink link(name, format);
  Exchanger bus(link, name.tcp ? Exchanger::Framing::tcp : Exchanger::Framing::rtu);
  Poller poller(bus, {{"d", p, slave, {}, name.tcp ? tcp_timing(p) : rtu_timing(p, format)}}, {.slow_divider = 1});
  std::map<std::string, double> seen;
  poller.on_sample = [&](const Sample& s) {
    if (s.value.quality == Quality::good) seen[p.channels[s.channel].name] = s.value.value;
  };
  for (int i = 0; i < steps; ++i) poller.step();
  EXPECT_EQ(poller.statistics(0).failed(), 0u);
  return seen;
}

std::vector<ServedDevice> served(const Profile& p, std::uint8_t id, std::string_view channel, double value) {
  auto device = std::make_shared<SlaveDevice>(p);
  device->set(channel, value);
  return {{id, device, 1'000'000}};
}

TEST(ModbusPort, OurMasterReadsOurDeviceOverAPseudoTerminal) {
  const test::TempFolder folder;
  const auto path = folder.path() / "bus";
  const Profile p = port_profile("laumas_tlb");
  Serving serving(serve_rtu(path, {115200, 'N', 1}), served(p, 3, "net", -7.0));
  EXPECT_DOUBLE_EQ(read_all("rtu:" + path.string(), p, 3, 20)["net"], -7.0);
}

TEST(ModbusPort, OurMasterReadsOurDeviceOverTcp) {
  const Profile p = port_profile("seneca_zsg3");
  Serving serving(serve_tcp(0), served(p, 1, "net", 12.75));
  EXPECT_DOUBLE_EQ(read_all(serving.server->where(), p, 1, 50)["net"], 12.75);
}

TEST(ModbusPort, LibmodbusAsClientReadsOurDeviceOverTcpAndHearsItsRefusals) {
  const Profile p = port_profile("hanmatek_hm310p");
  Serving serving(serve_tcp(0), served(p, 1, "voltage", 16.0));
  const PortName name = parse_port(serving.server->where(), "test");
  modbus_t* client = modbus_new_tcp("127.0.0.1", name.port);
  ASSERT_EQ(modbus_connect(client), 0);
  std::uint16_t words[4] = {};
  EXPECT_EQ(modbus_read_registers(client, 0x10, 4, words), 4);
  EXPECT_EQ(words[0] * 1.0, 16.0) << "decimals 0 in the emulated device: volts as they are";
  EXPECT_EQ(modbus_read_registers(client, 0x100, 1, words), -1);
  EXPECT_EQ(errno, EMBXILADD);
  EXPECT_EQ(modbus_write_register(client, 0x01, 1), 1);
  modbus_close(client);
  modbus_free(client);
}

TEST(ModbusPort, OurMasterReadsLibmodbusAsServerOverASerialLineOfTwoPseudoTerminalEnds) {
  int near_end = -1, far_end = -1;
  char name[128];
  termios raw{};
  cfmakeraw(&raw);
  ASSERT_EQ(openpty(&near_end, &far_end, name, &raw, nullptr), 0);
  modbus_t* server = modbus_new_rtu(name, 115200, 'N', 8, 1);  // gives the RTU framing; reads and writes go to the near end
  modbus_set_slave(server, 5);
  modbus_set_socket(server, near_end);
  modbus_set_indication_timeout(server, 0, 100'000);
  modbus_mapping_t* mapping = modbus_mapping_new(0, 0, 16, 16);
  mapping->tab_input_registers[0] = 1234;  // 12.34 V
  mapping->tab_input_registers[1] = 150;   // 1.50 A
  mapping->tab_input_registers[2] = 0x0001;
  mapping->tab_input_registers[3] = 0x0001;  // 6553.7 W, low word first
  std::atomic<bool> stop{false};
  std::thread thread([&] {
    std::uint8_t query[MODBUS_RTU_MAX_ADU_LENGTH];
    while (!stop) {
      const int n = modbus_receive(server, query);
      if (n > 0) modbus_reply(server, query, n, mapping);
    }
  });
  const auto seen = read_all(name, port_profile("pzem_017"), 5, 30);
  stop = true;
  thread.join();
  modbus_mapping_free(mapping);
  modbus_free(server);
  ::close(near_end);
  ::close(far_end);
  EXPECT_DOUBLE_EQ(seen.at("voltage"), 12.34);
  EXPECT_DOUBLE_EQ(seen.at("current"), 1.5);
  EXPECT_DOUBLE_EQ(seen.at("power"), 6553.7);
}

TEST(ModbusPort, TwoDevicesShareALineAndAnAbsentThirdCostsNoWrongValue) {
  const test::TempFolder folder;
  const auto path = folder.path() / "bus";
  Profile p = port_profile("laumas_tlb");
  p.timeout_ms = 60.0;
  p.late_max_ms = 90.0;
  std::vector<ServedDevice> devices = served(p, 1, "gross", 100.0);
  devices.push_back(served(p, 2, "gross", 200.0).front());
  Serving serving(serve_rtu(path, {115200, 'N', 1}), devices);
  PortLink link({false, path.string(), 0}, {115200, 'N', 1});
  Exchanger bus(link, Exchanger::Framing::rtu);
  std::vector<PolledDevice> polled;
  for (const std::uint8_t id : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{9}})
    polled.push_back({"cell", p, id, {"gross"}, rtu_timing(p, {115200, 'N', 1})});
  Poller poller(bus, polled, {.failures_until_lost = 1'000'000, .retry_ns = 0});
  int values = 0;
  poller.on_sample = [&](const Sample& s) {
    if (p.channels[s.channel].name != "gross" || s.value.quality != Quality::good) return;
    ++values;
    EXPECT_DOUBLE_EQ(s.value.value, s.device == 0 ? 100.0 : 200.0);
  };
  while (values < 20) poller.step();  // a loaded machine may miss the 60 ms of this test's profile; it may not give a wrong value
}

TEST(ModbusPort, ATcpDeviceThatGoesAndComesBackIsFoundAgain) {
  Profile p = port_profile("seneca_zsg3");
  p.timeout_ms = p.late_max_ms = 100.0;  // of tries in vain; those that must succeed are repeated
  auto first = std::make_unique<Serving>(serve_tcp(0), served(p, 1, "net", 1.0));
  const PortName name = parse_port(first->server->where(), "test");
  PortLink link(name, {});
  Exchanger bus(link, Exchanger::Framing::tcp);
  Poller poller(bus, {{"cell", p, 1, {"net"}, tcp_timing(p)}}, {.failures_until_lost = 3, .retry_ns = 50'000'000});
  double net = 0.0;
  poller.on_sample = [&](const Sample& s) { net = s.value.value; };
  while (net != 1.0) poller.step();
  first.reset();
  while (!poller.lost(0)) poller.step();
  Serving second(serve_tcp(name.port), served(p, 1, "net", 2.0));
  while (net != 2.0) poller.step();
  EXPECT_FALSE(poller.lost(0));
}

TEST(ModbusPort, PortsThatCannotBeOpenedSayWhyAndWhatToDo) {
  const auto message = [](const std::string& port) -> std::string {
    try {
      PortLink link(parse_port(port, "--port"), {});
      return "opened";
    } catch (const Error& e) {
      return e.what();
    }
  };
  EXPECT_NE(message("rtu:/dev/no_such_port").find("the adapter is not connected"), std::string::npos) << message("rtu:/dev/no_such_port");
  EXPECT_NE(message("tcp:127.0.0.1:1").find("no device listens there"), std::string::npos) << message("tcp:127.0.0.1:1");
  EXPECT_NE(message("tcp:host:70000").find("give 1 to 65535"), std::string::npos);
  EXPECT_NE(message("tcp:").find("names no port"), std::string::npos);
}

}  // namespace
}  // namespace rotorloop::modbus

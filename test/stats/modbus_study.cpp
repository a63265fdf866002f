#include "test/stats/modbus_study.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdlib>

#include "bench/stand/instruments/poller.hpp"

namespace rotorloop::test {
namespace {

using namespace rotorloop::modbus;

std::uint64_t proof(std::uint64_t time_ns, std::uint64_t slave, std::uint64_t address) {
  std::uint64_t z = time_ns * 0x9E3779B97F4A7C15ull + slave * 0xD1B54A32D192ED03ull + address * 0x94D049BB133111EBull + 1;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  return z ^ (z >> 27);
}

// At 0 and at 100: four registers with the time of sampling, four with the proof.
class Witness : public RegisterSlave {
 public:
  explicit Witness(std::uint8_t id) : id_(id) {}

 protected:
  void sample(std::int64_t now_ns) override { now_ns_ = static_cast<std::uint64_t>(now_ns); }
  bool readable(int, std::uint16_t a) const override { return a < 8 || (a >= 100 && a < 108); }
  std::uint16_t value(int, std::uint16_t a) const override {
    const std::uint16_t base = a < 100 ? 0 : 100;
    const std::uint64_t bits = a - base < 4 ? now_ns_ : proof(now_ns_, id_, base);
    return static_cast<std::uint16_t>(bits >> (16 * (3 - (a - base) % 4)));
  }
  bool write(std::uint16_t, std::uint16_t) override { return false; }

 private:
  std::uint8_t id_;
  std::uint64_t now_ns_ = 0;
};

Profile witness_profile(const ModbusStudy& s) {
  return parse_profile(fmt::format(R"(format = 1
[device]
vendor = "test"
model = "witness"
source = "made up"
evidence = "emulated"
[bus]
baud = [{}]
format = "8N1"
timeout_ms = {}
byte_timeout_ms = 5.0
late_max_ms = {}
turnaround_ms = 2
source = "made up"
[[channel]]
name = "time_a"
quantity = "raw"
addr = 0
type = "u64"
[[channel]]
name = "proof_a"
quantity = "raw"
addr = 4
type = "u64"
[[channel]]
name = "time_b"
quantity = "raw"
addr = 100
type = "u64"
[[channel]]
name = "proof_b"
quantity = "raw"
addr = 104
type = "u64"
)",
                                   s.baud, s.timeout_ms, s.late_max_ms),
                       "witness.toml");
}

}  // namespace

ModbusStudyResult run_modbus_study(const ModbusStudy& study) {
  const Profile profile = witness_profile(study);
  const SerialFormat format = serial_format(profile);
  LineFaults faults = study.faults;
  faults.seed = study.seed;
  SerialHub hub(format, faults);
  Exchanger bus(hub, Exchanger::Framing::rtu);
  std::vector<PolledDevice> devices;
  for (const std::uint8_t id : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}}) {
    if (id != 3) hub.add({id, std::make_shared<Witness>(id), 2'000'000, 1'000'000});  // 3 is absent
    devices.push_back({fmt::format("slave{}", id), profile, id, {}, rtu_timing(profile, format)});
  }
  Poller poller(bus, devices, {.slow_divider = 1, .failures_until_lost = 1'000'000'000, .retry_ns = 0});
  ModbusStudyResult r;
  std::array<std::uint64_t, 3> time{};
  poller.on_sample = [&](const Sample& s) {
    ++r.accepted_values;
    if (s.channel % 2 == 0) {
      time[s.device] = s.value.raw;
      const auto sampled = static_cast<std::int64_t>(s.value.raw);
      if (sampled < s.sampled_ns - s.uncertainty_ns || sampled > s.sampled_ns + s.uncertainty_ns) ++r.wrong_times;
    } else if (s.value.raw != proof(time[s.device], s.device + 1, s.channel == 1 ? 0 : 100)) {
      ++r.wrong_registers;
    }
  };
  while (r.exchanges < study.exchanges) {
    poller.step();
    ++r.exchanges;
  }
  for (std::size_t d = 0; d < 3; ++d) r.failures += poller.statistics(d).failed();
  r.line = hub.counts();
  r.stray_bytes = bus.stray_bytes();
  r.virtual_s = static_cast<double>(hub.now_ns()) * 1e-9;
  return r;
}

std::string ModbusStudyResult::text() const {
  return fmt::format(
      "exchanges {}, of them without an accepted answer {}\nline: {} frames, {} with flipped bits, {} bytes lost, {} late answers, {} "
      "collisions, {} stray bytes thrown away\n"
      "values accepted {}: {} with a wrong register, {} sampled outside the stated interval; {:.0f} s of virtual time\n",
      exchanges, failures, line.frames, line.flipped, line.bytes_lost, line.late, line.collisions, stray_bytes, accepted_values,
      wrong_registers, wrong_times, virtual_s);
}

}  // namespace rotorloop::test

// Each fault that an adapter or its bus can have, by name: what is told, whether the bus carries frames again, and what is left behind when
// it is closed. One table for all; the figures of single faults stand in gs_usb_port_test.cpp. Time is the test's.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "host/bus/live/gs_usb/gs_usb_port.hpp"
#include "test/support/gs_usb/emulated_link.hpp"
#include "test/unit/host/bus/live_support.hpp"

namespace rotorloop::gs_usb {
namespace {

using emulated::CandlelightOptions;
using emulated::EmulatedLink;
using emulated::UsbPlug;

constexpr std::int64_t kStep_ns = 100'000, kOneSecond_ns = 1'000'000'000;

// Both channels of one adapter, ends of one bus: the fault strikes `near`, or the adapter.
struct Pair {
  explicit Pair(CandlelightOptions options) : plug(true, std::move(options)) {
    adapter = std::make_shared<Adapter>(Settings{}, std::make_unique<EmulatedLink>(plug));
    near = open("/0");
    far = open("/1");
  }
  std::unique_ptr<GsUsbPort> open(const char* name) {
    return std::make_unique<GsUsbPort>(parse_settings(name, "test"), adapter, [this] { return plug.now_ns; });
  }
  // Throws Error when the connection has ended.
  void pass(std::int64_t time_ns) {
    for (const std::int64_t end_ns = plug.now_ns + time_ns; plug.now_ns < end_ns; plug.now_ns += kStep_ns) {
      for (GsUsbPort* p : {near.get(), far.get()}) {
        if (p == nullptr) continue;
        p->flush();
        while (const auto f = p->receive_any()) heard += p == far.get();
      }
    }
  }
  // What became of what near offered, as a row of the table has it.
  std::string counted() const {
    if (!far) return "";
    return fmt::format("refused {}, malformed {}, dropped {}, unconfirmed {}, heard {} of {}", near->link_counters().refused_by_peer,
                       near->link_counters().malformed + far->link_counters().malformed, near->counters().dropped_tx,
                       near->link_counters().unconfirmed, heard, offered);
  }
  void offer(int count) {
    for (int i = 0; i < count; ++i, ++offered) near->send_any(test::frame_of(0x140, false, 8));
  }
  UsbPlug plug;
  std::shared_ptr<Adapter> adapter;
  std::unique_ptr<GsUsbPort> near, far;
  std::uint64_t heard = 0, offered = 0;
};

enum class Ends { goes_on, by_name, refused };
struct Fault {
  const char* name;
  Ends end;
  const char* text;  // in a notice, in the error that ends or refuses, or of the counters of counted()
  std::function<void(Pair&)> strike;
  CandlelightOptions options = {};
};
void PrintTo(const Fault& f, std::ostream* out) { *out << f.name; }

std::vector<Fault> faults() {
  return {
      {"stalls_of_transfers_out", Ends::goes_on, "refused 2, malformed 0, dropped 2, unconfirmed 0, heard 23 of 25",
       [](Pair& p) { p.plug.device->faults.stalled_out = 2; }},
      {"stalls_of_transfers_in", Ends::goes_on, "refused 0, malformed 2, dropped 0, unconfirmed 0, heard 25 of 25",
       [](Pair& p) { p.plug.device->faults.stalled_in = 2; }},
      {"transfers_in_cut_short", Ends::goes_on, "refused 0, malformed 2, dropped 0, unconfirmed 1, heard 24 of 25",
       [](Pair& p) { p.plug.device->faults.cut_in = 2; }},
      {"transfers_in_lost", Ends::goes_on, "refused 0, malformed 0, dropped 0, unconfirmed 1, heard 24 of 25",
       [](Pair& p) { p.plug.device->faults.swallowed_in = 2; }},
      {"a_transfer_out_that_never_ends", Ends::goes_on, "refused 1, malformed 0, dropped 1, unconfirmed 0, heard 24 of 25",
       [](Pair& p) { p.plug.device->faults.lost_out = 1; }},
      {"lost_echoes", Ends::goes_on, "refused 0, malformed 0, dropped 0, unconfirmed 3, heard 25 of 25",
       [](Pair& p) { p.plug.device->faults.lost_echoes = 3; }},
      {"an_overflow_in_the_adapter", Ends::goes_on, "receive buffer was full", [](Pair& p) { p.plug.device->faults.overflows = 1; }},
      {"error_passive", Ends::goes_on, "error passive", [](Pair& p) { p.plug.device->controller(0).count_errors(130, 0); }},
      {"bus_off", Ends::goes_on, "bus-off", [](Pair& p) { p.plug.device->controller(0).count_errors(256, 0); }},
      {"another_bit_rate", Ends::goes_on, "bit rate of all nodes", [](Pair& p) { p.plug.device->controller(1).rate_Hz = 500e3; }},
      {"nobody_acknowledges", Ends::goes_on, "nobody acknowledges", [](Pair& p) { p.far.reset(); }},
      {"unplugged", Ends::by_name, "the adapter is gone", [](Pair& p) { p.plug.unplugged_at = p.plug.transfers + 3; }},
      {"every_transfer_in_stalls", Ends::by_name, "transfers fail", [](Pair& p) { p.plug.device->faults.stalled_in = 100'000; }},
      {"no_answer_to_the_host_format", Ends::refused, "(stall)", [](Pair& p) { p.plug.device->faults.stalled_request = 0; }},
      {"no_answer_to_the_bit_timing", Ends::refused, "(stall)", [](Pair& p) { p.plug.device->faults.stalled_request = 1; }},
      {"no_answer_to_the_start", Ends::refused, "\"start or stop\"", [](Pair& p) { p.plug.device->faults.stalled_request = 2; }},
      {"limits_that_no_controller_has", Ends::refused, "limits of its bit timing that no controller has",
       [](Pair& p) {
         p.plug.device->faults.garbled_request = 4;
         p.plug.device->faults.garbage = emulated::Bytes(40, 0);
       }},
      {"an_answer_cut_short", Ends::refused, "cut short",
       [](Pair& p) {
         p.plug.device->faults.garbled_request = 4;
         p.plug.device->faults.garbage = emulated::Bytes(7, 1);
       }},
      {"a_channel_used_twice", Ends::refused, "open in this program already", [](Pair& p) { p.far = p.open("/1"); }},
      {"more_channels_reported_than_there_are", Ends::refused, "does not answer the request", {}, {.channels = 1, .reported_channels = 2}},
  };
}

class GsUsbFault : public ::testing::TestWithParam<Fault> {};

// An emulated candleLight stalls a request only once it is asked: those of opening are asked again by a second program.
std::string refusal_of(const Fault& f) {
  if (!f.strike) return test::refused([&] { Pair p(f.options); });
  Pair p(f.options);
  return test::refused([&] {
    f.strike(p);
    p.near.reset();
    p.far.reset();
    p.adapter = std::make_shared<Adapter>(Settings{}, std::make_unique<EmulatedLink>(p.plug));
    p.near = p.open("/0");
  });
}

TEST_P(GsUsbFault, IsToldEveryFrameIsAccountedForAndTheAdapterIsGivenBackWithoutATransferLeft) {
  const Fault& f = GetParam();
  if (f.end == Ends::refused) {
    EXPECT_THAT(refusal_of(f), ::testing::HasSubstr(f.text));
    return;
  }
  Pair p(f.options);
  std::string text;
  try {
    p.offer(5);
    p.pass(kOneSecond_ns / 100);
    f.strike(p);
    p.offer(20);
    p.pass(3 * kOneSecond_ns);
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
    text = e.what();
  }
  EXPECT_EQ(text.empty(), f.end == Ends::goes_on) << text;
  const auto& left = p.plug.device->faults;
  if (f.end == Ends::goes_on) {
    EXPECT_EQ(left.stalled_out + left.stalled_in + left.cut_in + left.swallowed_in + left.lost_out + left.lost_echoes + left.overflows, 0)
        << "each was struck";
  }
  while (const auto notice = p.near->next_notice()) text += *notice + "\n";
  while (const auto notice = p.far ? p.far->next_notice() : std::nullopt) text += *notice + "\n";
  EXPECT_THAT(text + p.counted(), ::testing::HasSubstr(f.text));
  const auto accounted = [&] { return p.near->counters().sent + p.near->counters().dropped_tx + p.near->link_counters().unconfirmed; };
  EXPECT_EQ(accounted(), p.offered);
  if (f.end == Ends::goes_on && p.far && p.plug.device->controller(1).rate_Hz == 1e6) {
    // A disarm as the last frame: the bus carries it, and it leaves before the channel is closed.
    const std::uint64_t before = p.heard;
    p.offer(1);
    p.near.reset();
    while (p.far->receive_any()) ++p.heard;
    EXPECT_EQ(p.heard, before + 1);
  }
  p.near.reset();
  p.far.reset();
  p.adapter.reset();
  EXPECT_FALSE(p.plug.claimed);
  EXPECT_EQ(p.plug.transfers_pending, 0);
}

INSTANTIATE_TEST_SUITE_P(Each, GsUsbFault, ::testing::ValuesIn(faults()), [](const auto& row) { return std::string(row.param.name); });

}  // namespace
}  // namespace rotorloop::gs_usb

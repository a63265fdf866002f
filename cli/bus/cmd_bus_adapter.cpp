// `rotorloop bus adapter`: what a gs_usb adapter is and how it stands; its lamp and its terminating resistor.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/bus/bus_commands.hpp"
#include "host/base/error.hpp"
#include "host/bus/bus_name.hpp"
#include "host/bus/live/gs_usb/bit_rate_search.hpp"
#include "host/bus/live/gs_usb/gs_usb_port.hpp"
#include "host/bus/live/live_clock.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;
using gs_usb::Request;

struct AdapterArguments {
  std::string bus;
  std::string identify, termination;  // "on", "off", or nothing
  bool listen = false, json = false;
};

gs_usb::Settings settings_of(const AdapterArguments& o) {
  const BusName name = parse_bus_name(o.bus, "bus");
  if (name.backend != BusBackend::gs_usb)
    throw Error(
        {"bus", "\"" + o.bus + "\" is no gs_usb adapter", "", "rotorloop bus list shows the adapters that are there, as gsusb:SERIAL"});
  return gs_usb::parse_settings(name.rest, "bus");
}

void set(gs_usb::Adapter& adapter, const gs_usb::Settings& s, bool has, Request request, const std::string& value, const char* what) {
  if (value.empty()) return;
  if (!has) throw gs_usb::refusal(s, std::string("the adapter has no ") + what + " that can be switched", "", "leave the option out");
  adapter.order(s, request, gs_usb::encode_word(value == "on" ? 1 : 0));
}

Json timing_json(const BitTiming& t) {
  return {{"bit_rate_Hz", t.rate_Hz}, {"error_ppm", t.rate_error_ppm},     {"sample_point", t.sample_point}, {"prescaler", t.prescaler},
          {"quanta", t.quanta()},     {"seg1", t.prop_seg + t.phase_seg1}, {"seg2", t.phase_seg2},           {"sjw", t.sjw}};
}

// What the adapter has of itself, of its state and of the bit timing that the name asks for.
Json describe(gs_usb::Adapter& adapter, const gs_usb::Settings& s, const gs_usb::ChannelInfo& info) {
  const gs_usb::ChannelTiming timing = choose_timing(s, info);
  Json j{{"adapter", s.name()},
         {"software", adapter.config().software},
         {"hardware", adapter.config().hardware},
         {"channels", adapter.channels()},
         {"clock_Hz", info.clock_Hz},
         {"fd", info.has(gs_usb::kFd)},
         {"hardware_stamps", info.has(gs_usb::kHardwareStamp)},
         {"timing", timing_json(timing.nominal)}};
  if (timing.data) j["data_timing"] = timing_json(*timing.data);
  if (info.has(gs_usb::kTermination)) j["termination"] = gs_usb::decode_word(adapter.ask(s, Request::get_termination, 4)).value_or(0) != 0;
  if (info.has(gs_usb::kGetState)) {
    if (const auto state = gs_usb::decode_state(adapter.ask(s, Request::get_state, gs_usb::kState_B))) {
      static constexpr std::array<const char*, 6> kStates{"error active", "error warning", "error passive",
                                                          "bus-off",      "stopped",       "sleeping"};
      j["state"] = state->state < kStates.size() ? kStates[state->state] : "unknown";
      j["receive_errors"] = state->receive_errors;
      j["transmit_errors"] = state->transmit_errors;
    }
  }
  return j;
}

void print_heard(const Json& rate) {
  if (rate.is_null()) {
    fmt::print("  {:<15} nothing heard at any rate: nobody talks, no wire, or CAN FD alone\n", "bus");
  } else {
    fmt::print("  {:<15} {} bit/s, by a frame that came whole\n", "bus", rate.get<unsigned>());
  }
}

void print_timing(const char* what, const Json& t) {
  fmt::print("  {:<15} {:.0f} bit/s ({:.0f} ppm off), sampled at {:.1f} %: prescaler {}, 1 + {} + {} quanta, sjw {}\n", what,
             t["bit_rate_Hz"].get<double>(), t["error_ppm"].get<double>(), 100.0 * t["sample_point"].get<double>(),
             t["prescaler"].get<unsigned>(), t["seg1"].get<unsigned>(), t["seg2"].get<unsigned>(), t["sjw"].get<unsigned>());
}

void print(const Json& j) {
  fmt::print("{}\n  {:<15} {}, software {}, hardware {}\n", j["adapter"].get<std::string>(), "channels", j["channels"].get<unsigned>(),
             j["software"].get<unsigned>(), j["hardware"].get<unsigned>());
  fmt::print("  {:<15} {} Hz; {}, {}\n", "controller", j["clock_Hz"].get<unsigned>(), j["fd"].get<bool>() ? "CAN FD" : "classic CAN alone",
             j["hardware_stamps"].get<bool>() ? "stamps frames" : "no stamps");
  print_timing("bit timing", j["timing"]);
  if (j.contains("data_timing")) print_timing("of CAN FD's data", j["data_timing"]);
  if (j.contains("termination")) fmt::print("  {:<15} {}\n", "termination", j["termination"].get<bool>() ? "on" : "off");
  if (j.contains("state"))
    fmt::print("  {:<15} {}, {} errors sending, {} receiving\n", "state", j["state"].get<std::string>(),
               j["transmit_errors"].get<unsigned>(), j["receive_errors"].get<unsigned>());
  if (j.contains("bus_bit_rate_Hz")) print_heard(j["bus_bit_rate_Hz"]);
}

int run(const AdapterArguments& o) {
  const gs_usb::Settings s = settings_of(o);
  const auto adapter = gs_usb::open_adapter(s);
  const gs_usb::ChannelInfo info = adapter->channel(s);
  set(*adapter, s, info.has(gs_usb::kIdentify), Request::identify, o.identify, "lamp");
  set(*adapter, s, info.has(gs_usb::kTermination), Request::set_termination, o.termination, "terminating resistor");
  Json j = describe(*adapter, s, info);
  if (o.listen) {
    const auto heard_Hz = gs_usb::search_bit_rate(s, *adapter, live_now_ns);
    j["bus_bit_rate_Hz"] = heard_Hz ? Json(*heard_Hz) : Json();
  }
  if (o.json) {
    fmt::print("{}\n", j.dump(2));
  } else {
    print(j);
  }
  return 0;
}

}  // namespace

void add_bus_adapter(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<AdapterArguments>();
  CLI::App* c = group.add_subcommand("adapter", "a gs_usb adapter: controller, bit timing, state; its lamp and its terminating resistor");
  c->add_option("bus", o->bus, "gsusb:SERIAL/CHANNEL@BITRATE,DATARATE; each part may be left out")->required();
  c->add_option("--identify", o->identify, "on: the adapter blinks, to be told from others; off")->check(CLI::IsMember({"on", "off"}));
  c->add_option("--termination", o->termination, "on, off: the resistor of 120 ohm, where the adapter can switch it")
      ->check(CLI::IsMember({"on", "off"}));
  c->add_flag(
      "--listen", o->listen,
      "which bit rate the bus has: only receives, disturbs nobody, tries the rate of the name, then 1000000, 500000, 250000, 125000");
  c->add_flag("--json", o->json, "one JSON document instead of text");
  c->footer("Example:\n  rotorloop bus adapter gsusb:@1000000,4000000   # the only one there is, with its bit timing for these rates");
  c->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace rotorloop::cli

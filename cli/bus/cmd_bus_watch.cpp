// `rotorloop bus dump` and `rotorloop bus stat`: frames as they come, and who sends what how often; of a live bus or of a recording.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/bus/bus_commands.hpp"
#include "cli/bus/live_options.hpp"
#include "host/base/error.hpp"
#include "host/bus/bus_log.hpp"
#include "host/bus/candump_log.hpp"
#include "host/tools/frame_text.hpp"
#include "host/tools/traffic_table.hpp"
#include "host/tools/transfer_listener.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;

struct WatchArguments {
  std::string source;  // a bus or a file
  LiveOptions live;
  std::vector<std::string> filters;
  std::uint64_t count = 0;
  double bit_rate_Hz = 1e6;
  bool raw = false, frames = false;
};

bool names_a_file(const std::string& source) { return std::filesystem::exists(source) || source.find(':') == std::string::npos; }

std::uint32_t hex_number(std::string_view text, const std::string& filter) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size() || value >= 1u << 29)
    throw Error({"--filter", "\"" + filter + "\" is no ID or ID/MASK in hexadecimal", "",
                 "write 3 digits for an 11-bit identifier (140/7F0), 8 for a 29-bit one (00040A00/00FFFF00: esc.Status of any node)"});
  return value;
}

std::vector<CanFilter> parse_filters(const std::vector<std::string>& texts) {
  std::vector<CanFilter> filters;
  for (const std::string& text : texts) {
    const std::size_t slash = std::min(text.find('/'), text.size());
    const std::string_view id = std::string_view(text).substr(0, slash);
    CanFilter f{.id = hex_number(id, text), .mask = 0x1FFFFFFF, .extended = id.size() > 3};
    if (slash < text.size()) f.mask = hex_number(std::string_view(text).substr(slash + 1), text);
    filters.push_back(f);
  }
  if (filters.size() > CanBus::kFilters)
    throw Error({"--filter", fmt::format("{} filters, a bus has {}", filters.size(), CanBus::kFilters), "", "join some by a wider mask"});
  return filters;
}

bool passes(const std::vector<CanFilter>& filters, const BusFrame& f) {
  return filters.empty() || std::any_of(filters.begin(), filters.end(), [&](const CanFilter& x) { return x.fits(f.id, f.extended); });
}

// "12:34:56.123456" of a live bus; "12.345678" of a recording that begins in 1970, as a virtual run does.
std::string time_text(std::int64_t time_ns) {
  constexpr std::int64_t kDay_s = 86'400;
  const std::int64_t s = time_ns / 1'000'000'000, us = time_ns / 1'000 % 1'000'000;
  if (s < 365 * kDay_s) return fmt::format("{:>8}.{:06}", s, us);
  const std::int64_t of_day = s % kDay_s;
  return fmt::format("{:02}:{:02}:{:02}.{:06}", of_day / 3600, of_day / 60 % 60, of_day % 60, us);
}

class Printer {
 public:
  explicit Printer(const WatchArguments& o, std::string interface) : o_(o), interface_(std::move(interface)) {}
  void operator()(const StampedBusFrame& f) {
    if (o_.raw) {
      std::array<char, 256> line{};
      const std::size_t size = format_candump(line.data(), f.time_ns, interface_, f.frame);
      print(std::string(line.data(), size - 1));
    } else if (o_.frames) {
      print_frame(f);
    } else if (const auto transfer = listener_.accept(f)) {
      print_transfer(f, *transfer);
    } else if (!f.frame.extended) {
      print_fast(f);
    }
  }
  bool full() const { return o_.count > 0 && printed_ >= o_.count; }
  std::uint64_t broken() const { return listener_.broken(); }

 private:
  void print(const std::string& line) {
    ++printed_;
    fmt::print("{}\n", line);
  }
  static Json head(const StampedBusFrame& f, const tools::FrameKind& kind) {
    Json j{{"time_s", static_cast<double>(f.time_ns) * 1e-9}, {"id", tools::id_text(f.frame)}, {"type", kind.type}, {"role", kind.role}};
    if (kind.source >= 0) j["source"] = kind.source;
    if (kind.destination >= 0) j["destination"] = kind.destination;
    return j;
  }
  static std::string titled(const tools::FrameKind& kind) {
    return kind.type + (kind.role.empty() || kind.role == "message" ? "" : " " + kind.role);
  }
  void print_frame(const StampedBusFrame& f) {
    const tools::FrameKind kind = tools::frame_kind(f.frame);
    if (o_.live.json) {
      Json j = head(f, kind);
      j["data"] = tools::data_text(f.frame);
      j["extended"] = f.frame.extended;
      j["fd"] = f.frame.fd;
      return print(j.dump());
    }
    print(fmt::format("{} {:>8} {:<16} {:<14} {}", time_text(f.time_ns), tools::id_text(f.frame), tools::data_text(f.frame),
                      tools::addresses(kind), titled(kind)));
  }
  void print_transfer(const StampedBusFrame& f, const tools::HeardTransfer& t) {
    const tools::FrameKind kind = tools::frame_kind(f.frame);
    std::string payload;
    for (const std::uint8_t byte : t.payload) payload += fmt::format("{:02X}", byte);
    if (o_.live.json) {
      Json j = head(f, kind);
      j["transfer_id"] = t.transfer_id;
      j["payload"] = payload;
      j["fields"] = t.fields;
      if (t.wrong_crc) j["wrong_crc"] = true;
      return print(j.dump());
    }
    print(fmt::format("{} {:<14} {:<24} {}", time_text(f.time_ns), tools::addresses(kind), titled(kind),
                      t.wrong_crc          ? "wrong CRC: damaged, or another definition of this type; " + payload
                      : t.fields.is_null() ? payload
                                           : tools::fields_text(t.fields)));
  }
  void print_fast(const StampedBusFrame& f) {
    const Json fields = tools::decode_fast(f.frame);
    if (fields.is_null()) return print_frame(f);
    const tools::FrameKind kind = tools::frame_kind(f.frame);
    if (o_.live.json) {
      Json j = head(f, kind);
      j["fields"] = fields;
      return print(j.dump());
    }
    print(fmt::format("{} {:<14} {:<24} {}", time_text(f.time_ns), "", kind.type, tools::fields_text(fields)));
  }

  const WatchArguments& o_;
  std::string interface_;
  tools::TransferListener listener_;
  std::uint64_t printed_ = 0;
};

// Calls `take` for every frame of a bus or file until it says that it has enough.
int watch(const WatchArguments& o, const std::function<bool(const StampedBusFrame&)>& take) {
  check_live_options(o.live);
  const std::vector<CanFilter> filters = parse_filters(o.filters);
  if (names_a_file(o.source)) {
    const BusLog log = read_bus_log(o.source);
    for (const LoggedFrame& f : log.frames) {
      if (passes(filters, f.frame) && !take({.frame = f.frame, .time_ns = f.time_ns})) break;
    }
    for (const std::string& note : log.notes) fmt::print(stderr, "{}: {}\n", o.source, note);
    if (log.skipped_remote + log.skipped_error > 0)
      fmt::print(stderr, "{}: passed over: {} remote frames, {} error reports\n", o.source, log.skipped_remote, log.skipped_error);
    return 0;
  }
  const auto bus = open_recorded(o.live, o.source, "bus");
  bus->set_filters(filters);
  TimedBus* const alone = bus.get();
  const LiveEnd end = run_live({&alone, 1}, o.live, [&]() -> std::optional<std::int64_t> {
    while (const auto f = bus->receive_any()) {
      if (!take(*f)) return std::nullopt;
    }
    return INT64_MAX;
  });
  finish_recording(*bus);
  tell_losses(*bus);
  return end.exit_code;
}

int dump(const WatchArguments& o) {
  Printer print(o, names_a_file(o.source) ? "can0" : interface_name(o.source));
  const int code = watch(o, [&](const StampedBusFrame& f) {
    print(f);
    return !print.full();
  });
  if (print.broken() > 0)
    fmt::print(stderr, "{} frames belong to no transfer: their start was missed, or a frame between was lost\n", print.broken());
  return code;
}

Json row_json(const tools::TrafficRow& row, double span_s) {
  const tools::FrameKind kind = tools::frame_kind(row.newest);
  Json j{{"id", tools::id_text(row.newest)},
         {"fd", row.newest.fd},
         {"type", kind.type},
         {"role", kind.role},
         {"frames", row.frames},
         {"rate_Hz", span_s > 0.0 ? static_cast<double>(row.frames) / span_s : 0.0},
         {"longest_gap_ms", static_cast<double>(row.longest_gap_ns) * 1e-6},
         {"last_data", tools::data_text(row.newest)}};
  if (kind.source >= 0) j["source"] = kind.source;
  if (kind.destination >= 0) j["destination"] = kind.destination;
  return j;
}

int stat(const WatchArguments& o) {
  if (!(o.bit_rate_Hz >= 10e3 && o.bit_rate_Hz <= 1e6))
    throw Error({"--bit-rate", fmt::format("{} bit/s is out of range: 10000 to 1000000", o.bit_rate_Hz), "", "DroneCAN runs at 1000000"});
  tools::TrafficTable table;
  const int code = watch(o, [&](const StampedBusFrame& f) {
    table.add(f);
    return true;
  });
  const tools::Traffic t = table.traffic();
  const double span_s = static_cast<double>(t.last_ns - t.first_ns) * 1e-9, load = tools::load_percent(t, o.bit_rate_Hz);
  if (o.live.json) {
    Json rows = Json::array();
    for (const auto& row : t.rows) rows.push_back(row_json(row, span_s));
    fmt::print("{}\n", Json{{"source", o.source},
                            {"span_s", span_s},
                            {"frames", t.frames},
                            {"fd_frames", t.fd_frames},
                            {"load_percent", load},
                            {"bit_rate_Hz", o.bit_rate_Hz},
                            {"ids", rows}}
                           .dump(2));
    return code;
  }
  if (t.frames == 0) {
    fmt::print("no frames\n");
    return code;
  }
  fmt::print("{:>8}  {:<14} {:<34} {:>8} {:>9} {:>11}\n", "id", "from -> to", "type", "frames", "per s", "longest gap");
  for (const auto& row : t.rows) {
    const tools::FrameKind kind = tools::frame_kind(row.newest);
    fmt::print("{:>8}  {:<14} {:<34} {:>8} {:>9.1f} {:>8.1f} ms\n", tools::id_text(row.newest), tools::addresses(kind),
               kind.type + (kind.role.empty() || kind.role == "message" ? "" : " " + kind.role), row.frames,
               span_s > 0.0 ? static_cast<double>(row.frames) / span_s : 0.0, static_cast<double>(row.longest_gap_ns) * 1e-6);
  }
  fmt::print("{} frames in {:.3f} s, {:.1f} % of a bus of {:.0f} kbit/s{}\n", t.frames, span_s, load, o.bit_rate_Hz * 1e-3,
             t.fd_frames > 0 ? fmt::format(" (without {} CAN FD frames)", t.fd_frames) : "");
  return code;
}

void add_watch(CLI::App& c, WatchArguments& o) {
  c.add_option("bus", o.source, std::string(kBusHelp) + "; or a recording (candump -L or pcap)")->required();
  c.add_option("--filter", o.filters,
               "only frames with the identifier ID or ID/MASK, hexadecimal: 3 digits for 11 bits, 8 digits for 29 bits")
      ->allow_extra_args(false);
  c.add_flag("--json", o.live.json, "JSON instead of text");
  add_live_options(c, o.live);
}

}  // namespace

void add_bus_dump(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<WatchArguments>();
  CLI::App* c = group.add_subcommand("dump", "print the messages on a bus as they arrive, decoded");
  add_watch(*c, *o);
  c->add_option("--count", o->count, "end after this many lines");
  c->add_flag("--frames", o->frames, "one line for each frame, not for each transfer");
  c->add_flag("--raw", o->raw, "print lines of candump -L, for canplayer and other tools")->excludes("--json")->excludes("--frames");
  c->footer(
      "Examples:\n"
      "  rotorloop bus dump mcast:0\n"
      "  rotorloop bus dump mcast:0 --filter 00040A00/00FFFF00 --for 5   # only esc.Status\n"
      "  rotorloop bus dump slcan:/dev/ttyACM0 --record bench.pcap\n"
      "With --json each line is one JSON object. Times are UTC.");
  c->callback([o, &exit_code] { exit_code = dump(*o); });
}

void add_bus_stat(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<WatchArguments>();
  o->live.for_s = 5.0;
  CLI::App* c = group.add_subcommand("stat", "message rates of each node, and the bus load");
  add_watch(*c, *o);
  c->add_option("--bit-rate", o->bit_rate_Hz, "bit rate of the bus, bit/s, for the bus load")->capture_default_str();
  c->footer(
      "Examples:\n"
      "  rotorloop bus stat mcast:0                 # five seconds\n"
      "  rotorloop bus stat run/horizontal/pd_ff/1/esc_bus.log\n"
      "The load counts all bits of a frame with stuff bits and intermission. On a multicast bus it is the load that the same frames would\n"
      "cause on a CAN bus.");
  c->callback([o, &exit_code] { exit_code = stat(*o); });
}

}  // namespace rotorloop::cli

// `rotorloop esc commission`: the ESC measures its motor; what it found becomes its parameters.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "cli/esc/held_key.hpp"
#include "host/base/error.hpp"
#include "host/tools/commission.hpp"

namespace rotorloop::cli {
namespace {

struct CommissionArguments {
  EscOptions esc;
  tools::CommissionOptions commission;
  int node = 0;
  bool rest_only = false, save = false, yes = false;
};

// What a person types while the speed is held, without stopping the program: "1180" or "1180 reversed".
class TypedCount {
 public:
  struct Count {
    double rpm;
    bool reversed;
  };
  std::optional<Count> poll() {
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    while (!closed_ && ::poll(&input, 1, 0) > 0) {
      char c = 0;
      if (::read(STDIN_FILENO, &c, 1) != 1) closed_ = true;
      if (closed_ || c == '\n') return parse();
      line_ += c;
    }
    return std::nullopt;
  }

 private:
  std::optional<Count> parse() {
    const std::string line = std::exchange(line_, {});
    if (line.empty()) return std::nullopt;
    double rpm = 0.0;
    const auto [end, wrong] = std::from_chars(line.data(), line.data() + line.size(), rpm);
    const std::string word(end, line.data() + line.size());
    const bool reversed = word.find_first_not_of(' ') != std::string::npos;
    if (wrong != std::errc{} || !(rpm > 0.0 && rpm <= 200'000.0) || (reversed && word.find("reversed") == std::string::npos)) {
      fmt::print(stderr, "\"{}\" is no speed: type 0 to 200000 RPM, and add \"reversed\" if the motor turns in the wrong direction\n",
                 line);
      return std::nullopt;
    }
    return Count{rpm, reversed};
  }
  std::string line_;
  bool closed_ = false;
};

void ask_to_begin(EscSession& session, const CommissionArguments& o) {
  fmt::print(stderr, "Node {}: the motor {}. Is the propeller off, or the frame fixed? Press SPACE to begin.\n", o.node,
             o.rest_only ? "moves by one electrical turn" : "will run for about 15 s");
  HeldKey key;
  if (!session.tool().run_until(session.tool().now_ns() + 60'000'000'000, [&] { return key.pressed(session.tool().now_ns()); }))
    throw Error({"", "nothing was armed", "", ""}, ExitCode::interrupted);
}

void print_report(const tools::CommissionReport& r, bool saved) {
  fmt::print("node {}: {}\n", r.node, r.end);
  for (const auto& m : r.measured)
    fmt::print("  {:<18} {:>14}   was {}\n", m.name, tools::value_text(m.value), tools::value_text(m.before));
  if (!r.not_measured.empty()) fmt::print("  not measured, left as entered: {}\n", fmt::join(r.not_measured, ", "));
  if (!r.done()) return;
  fmt::print("{}; in force after a restart: rotorloop esc restart --node {}\n",
             saved ? "saved" : fmt::format("not saved: rotorloop esc save --node {} stores it", r.node), r.node);
}

// Progress to stderr; a message that repeats the one before only with another number is one of progress and goes to a terminal alone.
void tell(const std::string& text) {
  static const bool terminal = ::isatty(STDERR_FILENO) == 1;
  if (!text.starts_with("running") || terminal) fmt::print(stderr, "  {}\n", text);
}

int commission(CommissionArguments o) {
  o.commission.spin = !o.rest_only;
  if (!o.yes && ::isatty(STDIN_FILENO) != 1)
    throw Error({"--yes", "the motor would run, and standard input is no terminal to ask for confirmation", "",
                 "give --yes when the propeller is off or the frame is fixed"});
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  std::optional<tools::Commission> run;
  run.emplace(tool, static_cast<std::uint8_t>(o.node), o.commission, tell);
  session.nodes({o.node});
  if (!o.yes) ask_to_begin(session, o);
  run->begin();
  TypedCount typed;
  bool asked = false;
  while (!run->over()) {
    tool.poll();
    run->step(!session.stop().asked());
    if (run->wants_count()) {
      if (!std::exchange(asked, true))
        fmt::print(stderr,
                   "  speed held: measure it and type it in RPM within 30 s; add \"reversed\" if the motor turns in the wrong direction\n");
      if (const auto count = typed.poll()) run->counted(count->rpm, count->reversed);
    }
    tool.bus().wait_until(tool.now_ns() + 5'000'000);
  }
  // After a signal the tool's waits end at once: the node has ended it and was disarmed.
  if (session.stop().asked()) {
    fmt::print(stderr, "node {}: {}\n", o.node, run->state());
    session.finish();
    return session.stop().exit_code();
  }
  const tools::CommissionReport report = run->finish();
  const bool save = o.save && report.done();
  if (save) tools::execute(tool, report.node, tools::ParameterOrder::save);
  if (o.esc.live.json) {
    auto j = tools::commission_json(report);
    j["saved"] = save;
    fmt::print("{}\n", j.dump(2));
  } else {
    print_report(report, save);
  }
  session.finish();
  return report.done() ? 0 : to_int(ExitCode::safety);
}

}  // namespace

void add_esc_commission(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<CommissionArguments>();
  CLI::App* c = group.add_subcommand("commission", "let an ESC measure its motor: resistance, inductance, flux linkage, inertia");
  add_esc_options(*c, o->esc);
  c->add_option("--node", o->node, "node id of the ESC")->required();
  c->add_flag("--rest-only", o->rest_only, "measure only resistance and inductance: the rotor moves by one electrical turn at most");
  c->add_flag("--count", o->commission.count,
              "hold a speed until you have measured it and typed it in RPM: gives pole pairs and direction, which an ESC cannot measure");
  c->add_option("--kv", o->commission.speed_constant_rpm_V, "K_v on the label, RPM/V: compared with the measured one");
  c->add_option("--bell-inertia", o->commission.bell_inertia_kg_m2,
                "inertia of the rotor without propeller, kg m²: compared with the measured one");
  c->add_flag("--save", o->save, "store the measured values in the ESC, so that they survive a restart");
  c->add_flag("--yes", o->yes, "start without asking; only when the propeller is off or the frame is fixed");
  c->footer(
      "Takes 8 to 30 s. The motor must stand still, and no other node may send commands. All ESCs on the bus are armed during this time,\n"
      "but get no set-point. Ctrl-C ends the measurement; if this program is killed, the ESC ends it after 2.5 s.\n"
      "Example:\n  rotorloop esc commission --node 21 --kv 2300 --save\n"
      "Exit codes: 3 the ESC refused; 4 ended by a protection, by a command of another node, or by an implausible result.");
  c->callback([o, &exit_code] { exit_code = commission(*o); });
}

}  // namespace rotorloop::cli

#include "host/tools/commission.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "host/base/error.hpp"

namespace rotorloop::tools {
namespace {

using protocols::ParamGetSet;
using protocols::ParamGetSetResponse;

constexpr std::int64_t kCommissionArming_ns = 250'000'000, kQuestion_ns = 200'000'000, kNoAnswer_ns = 3'000'000'000;
constexpr std::uint8_t kCommissionArmingPriority = 8;

// What each part measures, by the ESC's names.
const std::vector<std::string> kAtRest{"resistance", "inductance", "inductance_ratio"}, kSpinning{"flux_linkage", "inertia", "load"},
    kCounted{"pole_pairs", "dir_reversed"};

void check_commission_range(const char* option, double value, double max, const char* unit) {
  if (value >= 0.0 && value <= max) return;
  throw Error({option, fmt::format("{} {} is out of range: 0 to {} {}", value, unit, max, unit), "", "leave it out when it is not known"});
}

std::string text_of_bytes(const auto& bytes) { return {bytes.items.begin(), bytes.items.begin() + bytes.count}; }

}  // namespace

Commission::Commission(ToolNode& tool, std::uint8_t node, const CommissionOptions& options, std::function<void(const std::string&)> said)
    : tool_(tool), node_(node), options_(options) {
  check_commission_range("--kv", options.speed_constant_rpm_V, 60'000.0, "rpm/V");
  check_commission_range("--bell-inertia", options.bell_inertia_kg_m2, 0.1, "kg m2");
  if (options.count && !options.spin)
    throw Error({"--count", "nothing turns in a commissioning at rest", "", "leave out --rest-only, or --count"});
  tool.on<protocols::LogMessage>([this, said = std::move(said)](const protocols::LogMessage& m, std::uint8_t source) {
    if (begun_ && source == node_ && said) said(text_of_bytes(m.text));
  });
}

void Commission::arm(bool armed) {
  using protocols::ArmingStatus;
  tool_.broadcast(ArmingStatus{.status = armed ? ArmingStatus::kFullyArmed : ArmingStatus::kDisarmed}, kCommissionArmingPriority);
}

void Commission::begin() {
  const auto order = find_parameter(tool_, node_, "commission");
  if (!order)
    throw Error({fmt::format("node {}", node_), "has no commissioning", "it is no ESC of rotorloop, or its firmware is older",
                 "enter the motor by hand: rotorloop esc set --node N --from MOTOR.toml"});
  for (const auto* names : {&kAtRest, &kSpinning, &kCounted}) {
    for (const std::string& name : *names) before_.push_back(read_parameter(tool_, node_, name));
  }
  const auto set = [&](const std::string& name, double value) {
    const NodeParameter p = read_parameter(tool_, node_, name);
    set_parameter(tool_, node_, p, protocols::ParamValue::of(static_cast<float>(value)));
  };
  set("commission_kv", options_.speed_constant_rpm_V);
  set("commission_bell", options_.bell_inertia_kg_m2);
  begun_ = true;
  arm(true);
  tool_.run_for(20'000'000);
  ParamGetSet request{.index = 0,
                      .value = protocols::ParamValue::of(std::int64_t{options_.count  ? 3
                                                                      : options_.spin ? 2
                                                                                      : 1}),
                      .name = "commission"};
  const auto r = tool_.ask<ParamGetSetResponse>(node_, request);
  if (!r || r->value.integer == 0) {
    arm(false);
    const std::string why = r ? value_text(read_parameter(tool_, node_, "stat_commission").value) : "does not answer";
    throw Error({fmt::format("node {}", node_), why, "", "nothing was measured; look at: rotorloop esc log"}, ExitCode::device);
  }
  heard_ns_ = tool_.now_ns();
}

void Commission::ask_state() {
  asking_ = true;
  tool_.request<ParamGetSet, ParamGetSetResponse>(node_, {.index = 0, .value = {}, .name = "stat_commission"},
                                                  [this](const std::optional<ParamGetSetResponse>& r) {
                                                    asking_ = false;
                                                    if (!r) return;
                                                    heard_ns_ = tool_.now_ns();
                                                    state_ = text_of_bytes(r->value.string);
                                                    over_ = over_ || !(state_.starts_with("running") || state_ == "stopping");
                                                  },
                                                  {.attempts = 1, .timeout_ns = 500'000'000});
}

void Commission::step(bool go_on) {
  if (over_) return;
  const std::int64_t now_ns = tool_.now_ns();
  if (now_ns - heard_ns_ > kNoAnswer_ns) {
    state_ = "ended: the node does not answer any more";
    over_ = true;
    return;
  }
  if (!go_on) {
    // Disarming ends it too, and needs no answer.
    if (now_ns >= next_arming_ns_) {
      arm(false);
      next_arming_ns_ = now_ns + kQuestion_ns;
    }
  } else if (now_ns >= next_arming_ns_) {
    arm(true);
    next_arming_ns_ = now_ns + kCommissionArming_ns;
  }
  if (!asking_ && now_ns >= next_question_ns_) {
    next_question_ns_ = now_ns + kQuestion_ns;
    ask_state();
  }
}

bool Commission::wants_count() const { return options_.count && !counted_ && state_.find("speed held") != std::string::npos; }

void Commission::counted(double rpm, bool reversed) {
  counted_ = true;
  // The direction first: the speed is what ends the waiting.
  const auto set = [&](const char* name, double value) {
    tool_.request<ParamGetSet, ParamGetSetResponse>(
        node_, {.index = 0, .value = protocols::ParamValue::of(static_cast<float>(value)), .name = name}, [](const auto&) {});
  };
  set("commission_dir", reversed ? 2.0 : 1.0);
  set("commission_rpm", rpm);
}

CommissionReport Commission::finish() {
  arm(false);
  tool_.run_for(50'000'000);
  CommissionReport report;
  report.node = node_;
  report.end = state_;
  const auto part = [&](const std::vector<std::string>& names, bool measured) {
    for (const std::string& name : names) {
      if (!measured || !report.done()) {
        report.not_measured.push_back(name);
        continue;
      }
      const auto old = std::find_if(before_.begin(), before_.end(), [&](const NodeParameter& p) { return p.name == name; });
      report.measured.push_back({name, old->value, read_parameter(tool_, node_, name).value});
    }
  };
  part(kAtRest, true);
  part(kSpinning, options_.spin);
  part(kCounted, counted_);
  return report;
}

nlohmann::ordered_json commission_json(const CommissionReport& report) {
  nlohmann::ordered_json j{
      {"node", report.node}, {"end", report.end}, {"measured", nlohmann::ordered_json::array()}, {"not_measured", report.not_measured}};
  for (const auto& m : report.measured)
    j["measured"].push_back({{"name", m.name}, {"before", value_json(m.before)}, {"value", value_json(m.value)}});
  return j;
}

}  // namespace rotorloop::tools

// Commissioning as the bus sees it: five values that can be set and are never stored, log messages of progress and result, and a state that
// can be read. The measuring itself is firmware/core/commission; the node decides whether it may begin and what ends it, and the
// application joins the two, at every poll:
//   node.on_commissioning(commissioning.result(), Board::kSwitchResistance_ohm);  node.poll(…);
//   commissioning.set_order(node.commissioning_order());
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/core/commission/result.hpp"
#include "firmware/core/node/text_line.hpp"
#include "protocols/fast_channel.hpp"

namespace rotorloop::firmware {

// What can be set besides the parameters. The first begins and ends it: 1 at rest, 2 spinning too, 3 spinning and holding the speed until
// somebody has counted it; 0 ends it.
struct CommissionValue {
  const char* name;
  float max;
  bool integer;
};
inline constexpr auto kCommissionValues = std::array{
    // `auto`: in flash (parameters.hpp)
    CommissionValue{"commission", 3, true},             //
    CommissionValue{"commission_kv", 60'000, false},    // rpm/V by the label; 0: not known, not compared
    CommissionValue{"commission_bell", 0.1f, false},    // kg m2, rotor without propeller; 0: not known, not compared
    CommissionValue{"commission_rpm", 200'000, false},  // mechanical, counted while the speed is held
    CommissionValue{"commission_dir", 2, true},         // seen: 0 not seen, 1 as wanted, 2 reversed
};

constexpr const char* commissioning_phase_text(CommissioningPhase phase) {
  constexpr std::array<const char*, 14> kTexts{"beginning",         "zero of the current sensors",
                                               "first inductance",  "aligning",
                                               "resistance",        "inductance",
                                               "inductance",        "solving",
                                               "aligning to spin",  "ramp",
                                               "speed held: count", "accelerating",
                                               "coasting",          "finished"};
  return kTexts[static_cast<std::size_t>(phase) < kTexts.size() ? static_cast<std::size_t>(phase) : 0];
}

constexpr const char* commissioning_end_text(CommissioningEnd end) {
  constexpr std::array<const char*, 28> kTexts{"running",
                                               "done",
                                               "cancelled",
                                               "order expired",
                                               "parameters that this board cannot serve",
                                               "current sensor",
                                               "overcurrent",
                                               "overvoltage",
                                               "undervoltage",
                                               "overtemperature",
                                               "no current: a phase is open",
                                               "the rotor does not turn",
                                               "observer lost the rotor",
                                               "resistance out of range",
                                               "inductance out of range",
                                               "inductance ratio out of range",
                                               "dead time out of range",
                                               "flux linkage out of range",
                                               "inertia out of range",
                                               "load out of range",
                                               "resistance of two runs differs",
                                               "inductance of two runs differs",
                                               "flux linkage of two runs differs",
                                               "inertia of two runs differs",
                                               "commission_kv contradicts: pole pairs wrong?",
                                               "counted speed fits no whole number of pole pairs",
                                               "inertia below commission_bell",
                                               "inertia far above commission_bell"};
  static_assert(kTexts.size() == static_cast<std::size_t>(CommissioningEnd::inertia_far_above_bell) + 1);
  return static_cast<std::size_t>(end) < kTexts.size() ? kTexts[static_cast<std::size_t>(end)] : "unknown";
}

class CommissionService {
 public:
  // The node that began it has to be heard, by any frame: NodeStatus comes at least once a second, and one may be lost.
  static constexpr std::uint64_t kSilent_us = 2'500'000;
  static constexpr std::uint64_t kProgress_us = 1'000'000;

  bool active() const { return state_ == State::running || state_ == State::stopping; }
  bool running() const { return state_ == State::running; }
  bool present() const { return present_; }
  const CommissioningResult& result() const { return result_; }
  float switch_ohm() const { return switch_ohm_; }

  float value(std::size_t i) const { return i == 0 ? (active() ? values_[0] : 0.0f) : values_[i]; }
  // Not the first: the node decides on that one. Clamped; not-a-number changes nothing.
  void set_value(std::size_t i, float v) {
    if (i == 0 || i >= values_.size() || !(v == v)) return;
    const float inside = v < 0.0f ? 0.0f : v > kCommissionValues[i].max ? kCommissionValues[i].max : v;
    values_[i] = kCommissionValues[i].integer ? static_cast<float>(static_cast<std::int32_t>(inside + 0.5f)) : inside;
  }

  void begin(std::int32_t task, std::uint8_t source, std::uint64_t now_us) {
    state_ = State::running;
    values_[0] = static_cast<float>(task);
    values_[3] = values_[4] = 0.0f;  // counted and seen of an earlier one
    source_ = source;
    heard_us_ = begun_us_ = now_us;
    reported_us_ = now_us;
    number_before_ = result_.number;
    reported_standstill_ = reported_held_ = false;
    reason_ = "";
  }
  void refuse(const char* why) {
    state_ = State::refused;
    reason_ = why;
  }
  void stop(const char* why, std::uint64_t now_us) {
    if (state_ != State::running) return;
    state_ = State::stopping;
    reason_ = why;
    stopped_us_ = now_us;
  }
  void heard(std::uint8_t source, std::uint64_t now_us) {
    if (source == source_) heard_us_ = now_us;
  }
  bool silent(std::uint64_t now_us) const { return now_us - heard_us_ > kSilent_us; }

  void take(const CommissioningResult& result, float switch_ohm) {
    present_ = true;
    result_ = result;
    switch_ohm_ = switch_ohm;
  }
  // True once: it is over, by itself or stopped. One that was stopped before its interrupt had begun has no result of its own.
  bool ended(std::uint64_t now_us) {
    if (!active()) return false;
    const bool own = result_.number != number_before_ && result_.end != CommissioningEnd::none;
    if (!own && !(state_ == State::stopping && now_us - stopped_us_ > 50'000)) return false;
    if (*reason_ == '\0') reason_ = commissioning_end_text(result_.end);
    state_ = own && result_.end == CommissioningEnd::done ? State::done : State::ended;
    return true;
  }
  bool done() const { return state_ == State::done; }
  // Its measurements contradict another parameter: nothing of it was taken.
  void reject(const char* why) {
    state_ = State::ended;
    reason_ = why;
  }

  CommissioningOrder order() const {
    if (state_ != State::running) return {};
    return {.task = values_[0] < 1.5f ? CommissioningTask::standstill : CommissioningTask::all,
            .speed_constant_rpm_V = values_[1],
            .bell_inertia_kg_m2 = values_[2],
            .wait_for_reference = values_[0] > 2.5f,
            .counted_rad_s = values_[3] * protocols::fast::kRadPerSecondPerRpm,
            .direction = static_cast<SeenDirection>(static_cast<std::uint8_t>(values_[4]))};
  }

  TextLine state_text() const {
    switch (state_) {
      case State::idle:
        return "idle";
      case State::running:
        return progress_text();
      case State::stopping:
        return "stopping";
      case State::refused:
        return TextLine("refused: ").add(reason_);
      case State::done:
        return "done";
      default:
        return TextLine("ended: ").add(reason_);
    }
  }
  TextLine progress_text() const {
    const bool own = result_.number != number_before_;
    return TextLine("running: ")
        .add(std::int32_t{own ? static_cast<std::int32_t>(100.0f * result_.progress) : 0})
        .add(" %, ")
        .add(commissioning_phase_text(own ? result_.phase : CommissioningPhase::idle));
  }
  bool progress_due(std::uint64_t now_us) {
    if (!running() || now_us - reported_us_ < kProgress_us) return false;
    reported_us_ = now_us;
    return true;
  }
  // Each true once.
  bool standstill_new() { return own() && result_.standstill_valid && once(reported_standstill_); }
  bool held_new() { return own() && values_[0] > 2.5f && result_.phase == CommissioningPhase::speed_held && once(reported_held_); }

  TextLine resistance_text() const {
    return TextLine("R ")
        .add_tenths(1e3f * result_.resistance_ohm)
        .add(" mohm with switches, L_d ")
        .add_tenths(1e6f * result_.inductance_d_H)
        .add(" uH, L_q ")
        .add_tenths(1e6f * result_.inductance_q_H)
        .add(" uH, dead time ")
        .add_tenths(1e9f * result_.dead_time_s)
        .add(" ns");
  }
  TextLine spin_text() const {
    return TextLine("flux ")
        .add_tenths(1e6f * result_.flux_linkage_Wb)
        .add(" uWb, inertia ")
        .add_tenths(1e9f * result_.inertia_kg_m2)
        .add("e-9 kg m2, friction ")
        .add_tenths(1e6f * result_.friction_N_m)
        .add(" uN m, load ")
        .add_tenths(1e9f * result_.load_N_m_s2)
        .add("e-9 N m s2");
  }
  TextLine reference_text(std::uint8_t entered_pole_pairs) const {
    TextLine line("pole pairs ");
    const bool counted = result_.spin_valid && result_.pole_pairs > 0;
    line.add(std::int32_t{counted ? result_.pole_pairs : entered_pole_pairs}).add(counted ? " measured" : " as entered, not measured");
    const SeenDirection seen = result_.spin_valid ? result_.direction : SeenDirection::not_seen;
    return line.add(seen == SeenDirection::not_seen    ? "; direction not measured"
                    : seen == SeenDirection::as_wanted ? "; direction as wanted"
                                                       : "; direction reversed, dir_reversed changed");
  }

 private:
  enum class State : std::uint8_t { idle, running, stopping, refused, done, ended };
  bool own() const { return active() && result_.number != number_before_; }
  static bool once(bool& told) {
    const bool first = !told;
    told = true;
    return first;
  }

  CommissioningResult result_{};
  std::array<float, kCommissionValues.size()> values_{};
  float switch_ohm_ = 0.0f;
  std::uint64_t heard_us_ = 0, begun_us_ = 0, reported_us_ = 0, stopped_us_ = 0;
  std::uint32_t number_before_ = 0;
  const char* reason_ = "";
  std::uint8_t source_ = 0;
  State state_ = State::idle;
  bool present_ = false, reported_standstill_ = false, reported_held_ = false;
};

}  // namespace rotorloop::firmware

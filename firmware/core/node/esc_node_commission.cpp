// A commissioning of the ESC asked for over the bus.
#include "firmware/core/node/esc_node.hpp"

namespace rotorloop::firmware {

void EscNode::order_commission(std::int32_t task, std::uint8_t source, std::uint64_t now_us) {
  if (task == 0) return commission_.stop("asked to stop", now_us);
  if (const char* why = why_no_commission(now_us)) {
    if (busy(now_us)) ++counters_.refused_while_running;
    if (!commission_.active()) commission_.refuse(why);
    return say(Level::warning, TextLine("commissioning refused: ").add(why), now_us);
  }
  commission_.begin(task, source, now_us);
  say(Level::info, TextLine("commissioning ").add(task == 1 ? "at rest" : "at rest, then spinning"), now_us);
}

// It drives the motor, so what holds for an order holds for it: armed, and by one will alone. Whoever sends commands, of zero too, does
// not expect the motor to turn by itself.
const char* EscNode::why_no_commission(std::uint64_t now_us) const {
  if (!commission_.present()) return "this firmware has none";
  if (commission_.active()) return "one is under way";
  if (!parameters_ok()) return "no valid parameters are stored";
  if (mode_ != protocols::NodeMode::operational || request_ != NodeRequest::none)
    return "starting up, or a save, restart or update is under way";
  if (turning()) return "the motor is running";
  if (!input_.armed()) return "not armed";
  if (input_.commanded(now_us)) return "commands for this ESC arrive";
  return nullptr;
}

void EscNode::watch_commission(std::uint64_t now_us) {
  if (!commission_.active()) return;
  if (!input_.armed()) commission_.stop("disarmed", now_us);
  if (input_.commanded(now_us)) commission_.stop("a command arrived", now_us);
  if (commission_.silent(now_us)) commission_.stop("the node that began it is silent", now_us);
  if (commission_.standstill_new()) say(Level::info, commission_.resistance_text(), now_us);
  if (commission_.held_new()) say(Level::info, "speed held: count it, set commission_dir and commission_rpm within 30 s", now_us);
  if (commission_.ended(now_us)) return take_commission(now_us);
  if (commission_.progress_due(now_us)) say(Level::info, commission_.progress_text(), now_us);
}

// What was measured becomes parameters, in force after saving and a restart, as if it had been set over the bus.
void EscNode::take_commission(std::uint64_t now_us) {
  if (!commission_.done()) return say(Level::warning, TextLine("commissioning ").add(commission_.state_text()), now_us);
  const Parameters found = with_commissioning(edited_, commission_.result(), commission_.switch_ohm());
  if (const auto wrong = check(found)) {
    commission_.reject("what was measured contradicts another parameter");
    say(Level::warning,
        TextLine("commissioning ended: measured ").add(kParameterRanges[wrong->index].name).add(" contradicts another parameter"), now_us);
    return;
  }
  const std::uint8_t entered = edited_.pole_pairs;
  edited_ = found;
  edited_new_ = true;
  if (commission_.result().spin_valid) say(Level::info, commission_.spin_text(), now_us);
  say(Level::info, commission_.reference_text(entered), now_us);
  say(Level::info, "commissioning done: save the parameters and restart", now_us);
}

}  // namespace rotorloop::firmware

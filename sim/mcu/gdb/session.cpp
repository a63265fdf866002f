#include "sim/mcu/gdb/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "sim/mcu/gdb/registers.hpp"

namespace rotorloop::mcu::gdb {
namespace {

constexpr uint64_t kCyclesAtOnce = 200'000;  // between two looks at the debugger: about 2 ms
constexpr uint32_t kMostBytes = 0x800;

std::string hex(std::span<const uint8_t> bytes) {
  std::string text;
  for (const uint8_t b : bytes) text += fmt::format("{:02x}", b);
  return text;
}
std::string hex(std::string_view text) { return hex(std::span(reinterpret_cast<const uint8_t*>(text.data()), text.size())); }

// Reads a number and what ends it; false: there is none.
bool number(std::string_view& text, uint32_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{}) return false;
  text.remove_prefix(static_cast<size_t>(end - text.data()));
  if (!text.empty()) text.remove_prefix(1);
  return true;
}
std::vector<uint8_t> from_hex(std::string_view text) {
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i + 1 < text.size(); i += 2) {
    uint8_t b = 0;
    if (std::from_chars(text.data() + i, text.data() + i + 2, b, 16).ec != std::errc{}) return {};
    bytes.push_back(b);
  }
  return bytes;
}
// Binary data: } stands before a byte that is changed by 0x20.
std::vector<uint8_t> unescaped(std::string_view text) {
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i < text.size(); ++i)
    bytes.push_back(static_cast<uint8_t>(text[i] == '}' && i + 1 < text.size() ? text[++i] ^ 0x20 : text[i]));
  return bytes;
}
uint8_t checksum(std::string_view body) {
  uint8_t sum = 0;
  for (const char c : body) sum = static_cast<uint8_t>(sum + static_cast<uint8_t>(c));
  return sum;
}
std::string framed(std::string_view body) { return fmt::format("${}#{:02x}", body, checksum(body)); }

}  // namespace

Session::Session(DebugTarget& target) : target_(target) { target_.core().stop_at_breakpoints(true); }

Session::~Session() {
  target_.core().watch(Watcher::debugger, nullptr);
  target_.core().stop_at_breakpoints(false);
  target_.core().state.at_breakpoint = false;
}

std::string Session::receive(std::string_view bytes) {
  input_ += bytes;
  std::string out;
  while (!input_.empty()) {
    if (input_[0] == '\x03') {  // Ctrl-C
      if (running_) {
        running_ = false;
        out += framed(last_stop_ = "T02thread:1;");
      }
      input_.erase(0, 1);
      continue;
    }
    if (input_[0] != '$') {  // acknowledges and noise
      input_.erase(0, 1);
      continue;
    }
    const size_t end = input_.find('#');
    if (end == std::string::npos || end + 2 >= input_.size()) break;
    const std::string body = input_.substr(1, end - 1), sum = input_.substr(end + 1, 2);
    input_.erase(0, end + 3);
    const bool whole = sum == fmt::format("{:02x}", checksum(body));
    if (acknowledges_) out += whole ? '+' : '-';
    if (whole) out += packet(body);
  }
  return out;
}

std::string Session::packet(std::string_view body) {
  const std::string reply = answer(body);
  return running_ || (ended_ && reply.empty()) ? "" : framed(reply);
}

std::string Session::answer(std::string_view body) {
  const char kind = body.empty() ? ' ' : body[0];
  const std::string_view rest = body.substr(body.empty() ? 0 : 1);
  switch (kind) {
    case '?':
      return last_stop_;
    case 'g':
      return registers();
    case 'G':
      return write_registers(rest);
    case 'p':
    case 'P':
      return one_register(body);
    case 'm':
      return memory(rest);
    case 'M':
      return write_memory(rest, false);
    case 'X':
      return write_memory(rest, true);
    case 'c':
    case 'C':
      return resume(false);
    case 's':
    case 'S':
      return resume(true);
    case 'Z':
    case 'z':
      return point(body);
    case 'H':
    case 'T':
      return "OK";
    case 'q':
    case 'Q':
      return query(body);
    case 'v':
      if (body == "vCont?") return "vCont;c;C;s;S";
      if (body.starts_with("vCont;")) return resume(body[6] == 's' || body[6] == 'S');
      if (!body.starts_with("vKill")) return "";
      ended_ = true;
      return "OK";
    case 'D':
      detached_ = true;
      return "OK";
    case 'k':
      ended_ = true;
      return "";
    default:
      return "";  // not supported
  }
}

std::string Session::query(std::string_view body) {
  if (body.starts_with("qSupported"))
    return fmt::format("PacketSize={:x};qXfer:features:read+;QStartNoAckMode+;swbreak+;hwbreak+;vContSupported+", 2 * kMostBytes);
  if (body == "QStartNoAckMode") {
    acknowledges_ = false;
    return "OK";
  }
  if (body.starts_with("qXfer:features:read:target.xml:")) {
    std::string_view range = body.substr(31);
    uint32_t offset = 0, length = 0;
    if (!number(range, offset) || !number(range, length)) return "E01";
    const std::string xml = target_xml();
    if (offset >= xml.size()) return "l";
    return (offset + length >= xml.size() ? "l" : "m") + xml.substr(offset, length);
  }
  if (body.starts_with("qRcmd,")) {
    const std::vector<uint8_t> text = from_hex(body.substr(6));
    return monitor({reinterpret_cast<const char*>(text.data()), text.size()});
  }
  if (body == "qAttached") return "1";
  if (body == "qC") return "QC1";
  if (body == "qfThreadInfo") return "m1";
  if (body == "qsThreadInfo") return "l";
  return "";
}

std::string Session::monitor(std::string_view command) {
  if (command == "reset" || command == "reset halt") {
    target_.reset();
    last_stop_ = "S05";
    return "OK";
  }
  const CoreState& s = target_.core().state;
  if (command == "cycles")
    return hex(fmt::format("cycle {}, {} instructions, {} waits of the flash\n", s.cycle, s.instructions, s.flash_waits));
  return hex(std::string_view("monitor reset: reset and hold. monitor cycles: time so far.\n"));
}

std::string Session::registers() {
  std::string text;
  for (uint32_t n = 0; n < register_count(); ++n) {
    const uint64_t value = read_register(target_.core(), n);
    uint8_t bytes[8];
    std::memcpy(bytes, &value, 8);
    text += hex(std::span(bytes, register_bytes(n)));
  }
  return text;
}

std::string Session::write_registers(std::string_view text) {
  const std::vector<uint8_t> bytes = from_hex(text);
  size_t at = 0;
  for (uint32_t n = 0; n < register_count() && at + register_bytes(n) <= bytes.size(); at += register_bytes(n++)) {
    uint64_t value = 0;
    std::memcpy(&value, &bytes[at], register_bytes(n));
    write_register(target_.core(), n, value);
  }
  return "OK";
}

std::string Session::one_register(std::string_view body) {
  std::string_view rest = body.substr(1);
  uint32_t n = 0;
  if (!number(rest, n) || n >= register_count()) return "E01";
  uint8_t bytes[8]{};
  uint64_t value = read_register(target_.core(), n);
  if (body[0] == 'p') {
    std::memcpy(bytes, &value, 8);
    return hex(std::span(bytes, register_bytes(n)));
  }
  const std::vector<uint8_t> wanted = from_hex(rest);
  if (wanted.size() != register_bytes(n)) return "E02";
  value = 0;
  std::memcpy(&value, wanted.data(), wanted.size());
  write_register(target_.core(), n, value);
  return "OK";
}

std::string Session::memory(std::string_view body) {
  uint32_t address = 0, size = 0;
  if (!number(body, address) || !number(body, size)) return "E01";
  std::vector<uint8_t> bytes(std::min(size, kMostBytes));
  return target_.read(address, bytes) ? hex(bytes) : "E0e";
}

std::string Session::write_memory(std::string_view body, bool binary) {
  uint32_t address = 0, size = 0;
  if (!number(body, address) || !number(body, size)) return "E01";
  const std::vector<uint8_t> bytes = binary ? unescaped(body) : from_hex(body);
  if (bytes.size() != size) return "E02";
  return bytes.empty() || target_.write(address, bytes) ? "OK" : "E0e";
}

std::string Session::point(std::string_view body) {
  if (body.size() < 4) return "E01";
  std::string_view rest = body.substr(3);
  uint32_t address = 0, size = 0;
  const char kind = body[1];
  if (!number(rest, address) || !number(rest, size) || kind > '4') return "";
  const bool set = body[0] == 'Z';
  if (kind <= '1') {
    if (set)
      breakpoints_.insert(address & ~1u);
    else
      breakpoints_.erase(address & ~1u);
    return "OK";
  }
  std::erase_if(watchpoints_, [&](const Watchpoint& w) { return w.address == address && w.bytes == size && w.kind == kind; });
  if (set) watchpoints_.push_back({address, size, kind});
  hit_ = nullptr;
  target_.core().watch(Watcher::debugger, watchpoints_.empty() ? nullptr : this);
  return "OK";
}

void Session::on_access(uint32_t address, uint32_t bytes, Access kind) {
  if (kind == Access::fetch || hit_ != nullptr) return;
  for (const Watchpoint& w : watchpoints_) {
    const bool meets = address < w.address + w.bytes && w.address < address + bytes;
    if (!meets || (w.kind == '2' && kind == Access::read) || (w.kind == '3' && kind == Access::write)) continue;
    hit_ = &w;
    hit_address_ = std::max(address, w.address);
    target_.core().stop_at(0);
    return;
  }
}

// Who goes on from a BKPT goes on behind it.
std::string Session::resume(bool one_step) {
  Core& core = target_.core();
  if (core.state.at_breakpoint) {
    core.state.at_breakpoint = false;
    core.set_pc(core.state.r[kPc] + 2);
  }
  hit_ = nullptr;
  if (!one_step) {
    running_ = resumed_ = true;
    return "";
  }
  return last_stop_ = stop_reply(execute(true));
}

// With breakpoints every instruction is looked at; without, nothing is slower for the debugger.
Halt Session::execute(bool one_step) {
  if (one_step) return target_.step();
  if (breakpoints_.empty() && watchpoints_.empty()) return target_.run_for(kCyclesAtOnce);
  const CoreState& s = target_.core().state;
  for (const uint64_t end = s.cycle + kCyclesAtOnce / 10; s.cycle < end;) {
    if (!resumed_ && s.phase == Phase::running && !s.sleeping && breakpoints_.contains(s.r[kPc])) return Halt::stopped;
    resumed_ = false;  // the first instruction is executed whatever stands on it
    const Halt halt = s.sleeping ? target_.run_for(kCyclesAtOnce / 10) : target_.step();
    if (halt != Halt::none || hit_ != nullptr) return halt;
  }
  return Halt::none;
}

std::string Session::run() {
  const Halt halt = execute(false);
  if (halt == Halt::none && hit_ == nullptr) return "";
  running_ = false;
  std::string out;
  if (halt == Halt::error) out += framed("O" + hex(target_.message() + "\n"));
  if (halt == Halt::locked_up) out += framed("O" + hex(std::string_view("locked up: a fault in HardFault or NMI\n")));
  return out + framed(last_stop_ = stop_reply(halt));
}

std::string Session::stop_reply(Halt halt) {
  if (hit_ != nullptr)
    return fmt::format("T05{}:{:x};thread:1;", hit_->kind == '2' ? "watch" : hit_->kind == '3' ? "rwatch" : "awatch", hit_address_);
  if (halt == Halt::locked_up || halt == Halt::error) return "T0bthread:1;";
  if (halt == Halt::stopped) return "T05hwbreak:;thread:1;";
  return "T05thread:1;";
}

}  // namespace rotorloop::mcu::gdb

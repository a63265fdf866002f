// gdb's remote serial protocol (gdb manual, appendix E) over any stream of bytes: what arrives, what is answered, when the target runs.
#pragma once
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sim/mcu/gdb/target.hpp"

namespace rotorloop::mcu::gdb {

class Session : private AccessWatch {
 public:
  explicit Session(DebugTarget& target);
  ~Session() override;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Bytes from the debugger; returns what goes back to it.
  std::string receive(std::string_view bytes);
  // While running(): executes for a while, and returns the stop packet when something ended it.
  std::string run();
  bool running() const { return running_; }
  bool ended() const { return ended_; }        // killed
  bool detached() const { return detached_; }  // the target goes on without a debugger

 private:
  struct Watchpoint {
    uint32_t address, bytes;
    char kind;  // '2' write, '3' read, '4' either
  };
  std::string packet(std::string_view body);
  std::string answer(std::string_view body);
  std::string query(std::string_view body);
  std::string monitor(std::string_view command);
  std::string registers();
  std::string write_registers(std::string_view hex);
  std::string one_register(std::string_view body);
  std::string memory(std::string_view body);
  std::string write_memory(std::string_view body, bool binary);
  std::string point(std::string_view body);
  std::string resume(bool one_step);
  std::string stop_reply(Halt halt);
  Halt execute(bool one_step);
  void on_access(uint32_t address, uint32_t bytes, Access kind) override;

  DebugTarget& target_;
  std::string input_, last_stop_ = "S05";
  std::set<uint32_t> breakpoints_;
  std::vector<Watchpoint> watchpoints_;
  const Watchpoint* hit_ = nullptr;
  uint32_t hit_address_ = 0;
  bool acknowledges_ = true, running_ = false, ended_ = false, detached_ = false, resumed_ = false;
};

}  // namespace rotorloop::mcu::gdb

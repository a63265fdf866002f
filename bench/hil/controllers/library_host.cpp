#include "bench/hil/controllers/library_host.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/hil/controllers/handshake.hpp"

namespace rotorloop::hil {
namespace {

constexpr int kServed = 0, kRefused = 1;

// Our end of the handshake; standard output itself is turned over to standard error, for what the library prints.
class AnswerStream {
 public:
  AnswerStream() : out_(fdopen(dup(STDOUT_FILENO), "w")) { dup2(STDERR_FILENO, STDOUT_FILENO); }
  ~AnswerStream() {
    if (out_) fclose(out_);
  }
  AnswerStream(const AnswerStream&) = delete;
  AnswerStream& operator=(const AnswerStream&) = delete;
  void write(const std::string& line) {
    fputs(line.c_str(), out_);
    fflush(out_);
  }
  int refuse(const std::string& why) {
    write(nlohmann::json{{"error", why}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    return kRefused;
  }

 private:
  std::FILE* out_;
};

std::string mismatch(const rotorloop_controller& c) {
  if (c.abi != ROTORLOOP_CONTROLLER_ABI)
    return fmt::format("ABI {}, here ABI {}: build it again with the header of this version", c.abi, ROTORLOOP_CONTROLLER_ABI);
  if (c.setup_size != sizeof(rotorloop_controller_setup) || c.input_size != sizeof(rotorloop_controller_input) ||
      c.output_size != sizeof(rotorloop_controller_output))
    return fmt::format("structures of {}, {} and {} bytes (setup, input, output), here {}, {} and {}", c.setup_size, c.input_size,
                       c.output_size, sizeof(rotorloop_controller_setup), sizeof(rotorloop_controller_input),
                       sizeof(rotorloop_controller_output));
  if (c.level < ROTORLOOP_LEVEL_POSITION || c.level > ROTORLOOP_LEVEL_ROTOR_SPEED) return fmt::format("level {}, allowed 1 to 3", c.level);
  if (c.every < 1 || c.every > 100) return fmt::format("every = {}, allowed 1 to 100", c.every);
  if (!c.create || !c.step || !c.destroy) return "create, step or destroy is null";
  return "";
}

rotorloop_controller_setup plain(const HandshakeSetup& s) {
  return {.size = sizeof(rotorloop_controller_setup),
          .abi = ROTORLOOP_CONTROLLER_ABI,
          .period_s = s.period_s,
          .mass_kg = s.mass_kg,
          .hover_omega_rad_s = s.hover_omega_rad_s,
          .omega_min_rad_s = s.omega_min_rad_s,
          .omega_max_rad_s = s.omega_max_rad_s,
          .vehicle_file = s.vehicle_file.c_str(),
          .gains_file = s.gains_file.c_str(),
          .flight = s.flight.c_str(),
          .log_folder = s.log_folder.c_str()};
}

int answer_steps(const rotorloop_controller& c, void* controller, AnswerStream& out) {
  std::string line;
  rotorloop_controller_input in{};
  while (std::getline(std::cin, line)) {
    if (const auto why = parse_input(line, in); !why.empty()) return out.refuse(why);
    rotorloop_controller_output answer = empty_output();
    c.step(controller, &in, &answer);
    out.write(output_line(in.step, answer));
  }
  return kServed;
}

}  // namespace

int serve_library(const std::filesystem::path& library) {
  AnswerStream out;
  std::string line;
  HandshakeSetup setup;
  if (!std::getline(std::cin, line)) return kRefused;
  if (const auto why = parse_setup(line, setup); !why.empty()) return out.refuse(why);
  void* handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) return out.refuse(dlerror());
  using Factory = const rotorloop_controller* (*)();
  const auto factory = reinterpret_cast<Factory>(dlsym(handle, "rotorloop_controller_factory"));
  if (!factory) return out.refuse("exports no rotorloop_controller_factory: declare it extern \"C\" as in controller_abi.h");
  const rotorloop_controller* c = factory();
  if (!c) return out.refuse("rotorloop_controller_factory() returned null");
  if (const auto why = mismatch(*c); !why.empty()) return out.refuse(why);
  const rotorloop_controller_setup s = plain(setup);
  void* controller = c->create(&s);
  if (!controller) return out.refuse("create() returned null");
  out.write(hello_line({.level = c->level, .every = c->every, .own_estimate = c->own_estimate != 0, .start_s = c->start_s}));
  const int code = answer_steps(*c, controller, out);
  c->destroy(controller);
  return code;
}

}  // namespace rotorloop::hil

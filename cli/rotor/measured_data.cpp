#include "cli/rotor/measured_data.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "host/base/error.hpp"

namespace rotorloop::cli {

std::filesystem::path measured_data_folder() {
  const char* name = std::getenv("ROTORLOOP_DATA");
  if (name == nullptr || *name == '\0')
    throw Error({"ROTORLOOP_DATA", "is not set: the folder with measured data is unknown", "",
                 "set ROTORLOOP_DATA to the folder that holds propellers/ (docs/manual/rotors.md, Validating the rotor)"},
                ExitCode::data_quality);
  std::error_code ec;
  if (!std::filesystem::is_directory(std::filesystem::path(name) / "propellers", ec))
    throw Error({"ROTORLOOP_DATA", fmt::format("{} holds no folder propellers", name), "another folder, or a misspelt path",
                 "set ROTORLOOP_DATA to the folder that holds propellers/"},
                ExitCode::data_quality);
  return name;
}

}  // namespace rotorloop::cli

#include "host/base/text_file.hpp"

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>

#include "host/base/error.hpp"

namespace rotorloop {
namespace fs = std::filesystem;

void write_text_file(const fs::path& path, std::string_view text) {
  std::error_code ec;
  // Pipes and devices are written to; a file appears under its name when it is whole, so that nobody reads half of it.
  const bool in_place = fs::exists(path, ec) && !fs::is_regular_file(path, ec);
  const fs::path at = in_place ? path : fs::path(path.string() + ".part");
  errno = 0;
  std::ofstream out(at, std::ios::binary | std::ios::trunc);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  const bool written = !out.fail();
  const int reason = errno;  // of the first call of the system that failed
  if (written && !in_place) fs::rename(at, path, ec);
  if (written && (in_place || !ec)) return;
  std::error_code ignored;
  if (!in_place) fs::remove(at, ignored);
  std::string what = "cannot be written";
  if (ec)
    what += ": " + ec.message();
  else if (reason != 0)
    what += ": " + std::generic_category().message(reason);
  throw Error({path.string(), what, "the disk is full, the folder does not exist, or it is read-only",
               "free space, correct the permissions, or choose another place with --out"},
              ExitCode::device);
}

}  // namespace rotorloop

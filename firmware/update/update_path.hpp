// The path of a request for an update: what no file server could be asked for is refused, never cut to another name.
#pragma once
#include <cstddef>

#include "firmware/core/node/text_line.hpp"
#include "protocols/receiver.hpp"
#include "protocols/types/file.hpp"

namespace rotorloop::firmware {

// True: too long, and `r` says so. The decoder takes the bytes that a path has room for: only the size of the payload tells of more.
inline bool refuse_long_path(const protocols::Transfer& request, protocols::BeginFirmwareUpdateResponse& r) {
  constexpr std::size_t kMost = protocols::FilePath::kMostBytes, kNodeId = 1;
  if (request.payload.size() <= kNodeId + kMost) return false;
  TextLine why("image_file_remote_path has ");
  why.add_decimal(static_cast<std::uint32_t>(request.payload.size() - kNodeId))
      .add(" bytes: a path has ")
      .add_decimal(kMost)
      .add(" at most");
  r.error = protocols::BeginFirmwareUpdateResponse::Error::unknown;
  r.message.assign(why.text().view());
  return true;
}

}  // namespace rotorloop::firmware

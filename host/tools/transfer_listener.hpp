// Hears everything on a bus: puts together the transfers of all nodes, whoever they are for, and decodes the types that are known. Made
// for looking, so it is more patient than a node: a transfer that begins again replaces the one before, repeated ones are shown.
#pragma once
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "host/bus/bus_frame.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::tools {

struct HeardTransfer {
  std::int64_t time_ns = 0;  // of its last frame
  protocols::FrameId id;
  std::uint8_t transfer_id = 0;
  bool fd = false;
  std::vector<std::uint8_t> payload;
  bool wrong_crc = false;         // damaged, or the sender has another definition of the type
  nlohmann::ordered_json fields;  // null: unknown type, or the payload does not fit it
};

class TransferListener {
 public:
  // A transfer when this frame ends one. Frames of the fast channel are transfers of their own (see decode_fast).
  std::optional<HeardTransfer> accept(const StampedBusFrame& frame);
  std::uint64_t broken() const { return broken_; }  // frames that belong to no transfer: a start was missed, a frame lost

 private:
  struct Session {
    std::vector<std::uint8_t> payload;
    std::uint8_t transfer_id = 0;
    bool toggle = false;
    bool open = false;
  };
  using Key = std::tuple<std::uint32_t, bool>;  // identifier without its priority, FD
  std::map<Key, Session> sessions_;
  std::uint64_t broken_ = 0;
};

// Fields of a set-point or feedback of the fast channel; null for any other frame.
nlohmann::ordered_json decode_fast(const BusFrame& frame);

// "rpm=8950 current=1.25": nested names with dots.
std::string fields_text(const nlohmann::ordered_json& fields);

}  // namespace rotorloop::tools

// One gs_usb adapter that this program has: its requests, its transfers, and whom each message is for. The ports of its channels share it.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/bus/live/gs_usb/adapter_choice.hpp"
#include "host/bus/live/gs_usb/usb_link.hpp"
#include "host/bus/live/gs_usb/wire.hpp"

namespace rotorloop::gs_usb {

// What a channel's port hears of its adapter, from within pump() and submit().
class ChannelListener {
 public:
  virtual ~ChannelListener() = default;
  virtual void take(const Message& message) = 0;
  virtual void malformed() = 0;                                     // no message could be made of a transfer
  virtual void transferred(std::uint32_t echo_id, bool whole) = 0;  // a frame reached the adapter, or did not
  virtual void lost(const std::string& why) = 0;                    // nothing comes any more
};

class Adapter {
 public:
  static constexpr int kMostFailures = 16;  // of transfers in, one after the other: it is gone or hangs

  // Asks for its channels. Throws Error (exit 3) where the answers are none of a gs_usb adapter.
  Adapter(const Settings& settings, std::unique_ptr<UsbLink> link);

  unsigned channels() const { return config_.channels; }
  const DeviceConfig& config() const { return config_; }
  // Throws Error (exit 3): there is no such channel, or the adapter refuses to tell of it.
  ChannelInfo channel(const Settings& settings);

  // Throw Error (exit 3) when the adapter refuses or is gone.
  void order(const Settings& settings, Request request, std::span<const std::uint8_t> data);
  std::vector<std::uint8_t> ask(const Settings& settings, Request request, std::size_t bytes);
  // For a channel that is left: whatever comes of it.
  void order_unheard(unsigned channel, Request request, std::span<const std::uint8_t> data);

  // False where the channel has a port in this program.
  bool attach(unsigned channel, ChannelListener& port, bool stamped);
  void detach(unsigned channel);

  UsbStatus submit(unsigned channel, std::uint32_t echo_id, std::span<const std::uint8_t> frame);
  void pump();  // takes what ended, without waiting
  bool input_waits() const { return link_->completion_waits(); }
  const std::optional<std::string>& lost() const { return lost_; }
  void wait(std::int64_t most_ns) { link_->wait(most_ns); }
  int descriptor() const { return link_->descriptor(); }

 private:
  struct Channel {
    ChannelListener* port = nullptr;
    bool stamped = false;
  };
  UsbAnswer request(bool in, Request request, unsigned value, std::span<std::uint8_t> data);
  void lose(const std::string& why);
  void take_in(const UsbCompletion& c);
  void take_out(const UsbCompletion& c);
  void submit_in(unsigned slot);
  void count_malformed();

  std::unique_ptr<UsbLink> link_;
  DeviceConfig config_;
  std::vector<Channel> ports_;
  std::optional<std::string> lost_;
  bool reading_ = false;
  int failures_ = 0;
};

}  // namespace rotorloop::gs_usb

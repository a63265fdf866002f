#include "host/bus/live/gs_usb/bit_rate_search.hpp"

#include <algorithm>
#include <array>
#include <string>

namespace rotorloop::gs_usb {
namespace {

constexpr std::array<std::uint32_t, 4> kRates_Hz{1'000'000, 500'000, 250'000, 125'000};

constexpr std::int64_t kPause_ns = 10'000'000;  // other channels of the adapter may be at work in this program

class Listener final : public ChannelListener {
 public:
  Listener(const Settings& settings, Adapter& adapter) : settings_(settings), adapter_(adapter) {
    if (!adapter.attach(settings.channel, *this, false))
      throw refusal(settings, "channel " + std::to_string(settings.channel) + " of this adapter is open in this program already", "",
                    "close it first");
  }
  ~Listener() {
    adapter_.order_unheard(settings_.channel, Request::mode, encode_mode(kModeReset, 0));
    adapter_.detach(settings_.channel);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  bool hears_at(const BitTiming& timing, const std::function<std::int64_t()>& now_ns) {
    adapter_.order(settings_, Request::mode, encode_mode(kModeReset, 0));
    adapter_.pump();  // what was on its way is of the rate before
    heard_ = false;
    adapter_.order(settings_, Request::bit_timing, encode_timing(timing));
    adapter_.order(settings_, Request::mode, encode_mode(kModeStart, kListenOnly));
    const std::int64_t end_ns = now_ns() + kListened_ns;
    while (!heard_ && now_ns() < end_ns) {
      adapter_.wait(std::min(end_ns - now_ns(), kPause_ns));
      adapter_.pump();
      if (lost_) throw refusal(settings_, "the adapter is gone: " + *lost_, "", "plug it in and start again");
    }
    return heard_;
  }

 private:
  void take(const Message& m) override { heard_ = heard_ || m.content == Content::frame || m.content == Content::remote; }
  void malformed() override {}
  void transferred(std::uint32_t, bool) override {}
  void lost(const std::string& why) override { lost_ = why; }

  const Settings& settings_;
  Adapter& adapter_;
  bool heard_ = false;
  std::optional<std::string> lost_;
};

}  // namespace

std::optional<std::uint32_t> search_bit_rate(const Settings& settings, Adapter& adapter, const std::function<std::int64_t()>& now_ns) {
  const ChannelInfo info = adapter.channel(settings);
  if (!info.has(kListenOnly))
    throw refusal(settings, "the adapter cannot listen without taking part", "",
                  "another bit rate than that of the bus would disturb it: look the rate up in the settings of its nodes");
  Listener listener(settings, adapter);
  Settings tried = settings;
  tried.data_rate_Hz.reset();
  if (listener.hears_at(choose_timing(tried, info).nominal, now_ns)) return settings.bit_rate_Hz;
  for (const std::uint32_t rate_Hz : kRates_Hz) {
    tried.bit_rate_Hz = rate_Hz;
    if (rate_Hz != settings.bit_rate_Hz && listener.hears_at(choose_timing(tried, info).nominal, now_ns)) return rate_Hz;
  }
  return std::nullopt;
}

}  // namespace rotorloop::gs_usb

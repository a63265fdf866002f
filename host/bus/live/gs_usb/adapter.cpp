#include "host/bus/live/gs_usb/adapter.hpp"

#include <algorithm>
#include <utility>

#include "host/bus/live/gs_usb/in_flight.hpp"

namespace rotorloop::gs_usb {
namespace {

static_assert(kMostChannels * InFlight::kMost <= UsbLink::kOutSlots);
constexpr unsigned kOfWholeAdapter = 1;  // the value of requests that are of no channel

constexpr const char* name_of(Request r) {
  switch (r) {
    case Request::host_format:
      return "byte order";
    case Request::bit_timing:
      return "bit timing";
    case Request::mode:
      return "start or stop";
    case Request::limits:
    case Request::limits_with_data:
      return "limits of bit timing";
    case Request::device_config:
      return "number of channels";
    case Request::time_stamp:
      return "clock";
    case Request::identify:
      return "identify";
    case Request::data_bit_timing:
      return "bit timing of CAN FD's data";
    case Request::set_termination:
    case Request::get_termination:
      return "termination";
    case Request::get_state:
      break;
  }
  return "state";
}

unsigned value_of(const Settings& s, Request r) {
  return r == Request::host_format || r == Request::device_config ? kOfWholeAdapter : s.channel;
}

Error request_error(const Settings& s, Request r, UsbStatus status) {
  if (status == UsbStatus::gone) return refusal(s, "the adapter is gone", "it was unplugged", "plug it in and start again");
  return refusal(s, std::string("the adapter does not answer the request \"") + name_of(r) + "\": " + text_of(status),
                 "its firmware is older than the request, or hangs", "plug it in again; update its firmware");
}

}  // namespace

Adapter::Adapter(const Settings& settings, std::unique_ptr<UsbLink> link) : link_(std::move(link)) {
  order(settings, Request::host_format, encode_word(kHostFormat));
  const auto config = decode_device_config(ask(settings, Request::device_config, kDeviceConfig_B));
  if (!config || config->channels > kMostChannels)
    throw refusal(settings,
                  config ? "the adapter tells of " + std::to_string(config->channels) + " channels; none has more than " +
                               std::to_string(kMostChannels)
                         : "the adapter's answer to the request \"number of channels\" is cut short",
                  "its firmware is damaged, or is no gs_usb", "update the adapter's firmware");
  config_ = *config;
  ports_.resize(config_.channels);
}

UsbAnswer Adapter::request(bool in, Request r, unsigned value, std::span<std::uint8_t> data) {
  if (lost_) return {.status = UsbStatus::gone, .bytes = 0};
  const UsbAnswer answer = link_->control(in, static_cast<std::uint8_t>(r), static_cast<std::uint16_t>(value), data);
  if (answer.status == UsbStatus::gone) lose("it was unplugged");
  return answer;
}

void Adapter::order(const Settings& s, Request r, std::span<const std::uint8_t> data) {
  std::vector<std::uint8_t> bytes(data.begin(), data.end());
  const UsbAnswer answer = request(false, r, value_of(s, r), bytes);
  if (answer.status != UsbStatus::ok) throw request_error(s, r, answer.status);
}

void Adapter::order_unheard(unsigned channel, Request r, std::span<const std::uint8_t> data) {
  std::vector<std::uint8_t> bytes(data.begin(), data.end());
  request(false, r, channel, bytes);
}

std::vector<std::uint8_t> Adapter::ask(const Settings& s, Request r, std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  const UsbAnswer answer = request(true, r, value_of(s, r), bytes);
  if (answer.status != UsbStatus::ok) throw request_error(s, r, answer.status);
  bytes.resize(std::min(answer.bytes, size));
  return bytes;
}

ChannelInfo Adapter::channel(const Settings& s) {
  if (s.channel >= channels())
    throw refusal(s, "the adapter has no channel " + std::to_string(s.channel) + ": it has " + std::to_string(channels()), "",
                  "count from 0");
  auto info = decode_channel(ask(s, Request::limits, kLimits_B));
  if (info && info->has(kLimitsWithData)) info = decode_channel(ask(s, Request::limits_with_data, kLimitsWithData_B));
  if (!info)
    throw refusal(s, "the adapter's answer to the request \"limits of bit timing\" is cut short",
                  "its firmware is damaged, or is no gs_usb", "update the adapter's firmware");
  return *info;
}

bool Adapter::attach(unsigned channel, ChannelListener& port, bool stamped) {
  if (ports_[channel].port != nullptr) return false;
  ports_[channel] = {.port = &port, .stamped = stamped};
  if (!std::exchange(reading_, true)) {
    for (unsigned slot = 0; slot < UsbLink::kInSlots; ++slot) submit_in(slot);
  }
  return true;
}

void Adapter::detach(unsigned channel) { ports_[channel] = {}; }

void Adapter::lose(const std::string& why) {
  if (lost_) return;
  lost_ = why;
  for (const Channel& c : ports_) {
    if (c.port != nullptr) c.port->lost(why);
  }
}

void Adapter::count_malformed() {
  const auto open = std::find_if(ports_.begin(), ports_.end(), [](const Channel& c) { return c.port != nullptr; });
  if (open != ports_.end()) open->port->malformed();
}

UsbStatus Adapter::submit(unsigned channel, std::uint32_t echo_id, std::span<const std::uint8_t> frame) {
  if (lost_) return UsbStatus::gone;
  const UsbStatus status = link_->submit_out(channel * InFlight::kMost + echo_id, frame);
  if (status == UsbStatus::gone) lose("it was unplugged");
  return status;
}

void Adapter::submit_in(unsigned slot) {
  if (lost_) return;
  const UsbStatus status = link_->submit_in(slot);
  if (status != UsbStatus::ok) lose(status == UsbStatus::gone ? "it was unplugged" : std::string("a transfer: ") + text_of(status));
}

void Adapter::take_in(const UsbCompletion& c) {
  if (c.status == UsbStatus::gone) return lose("it was unplugged");
  if (c.status != UsbStatus::ok) {
    if (++failures_ >= kMostFailures) return lose(std::string("transfers fail: ") + text_of(c.status));
    if (c.status == UsbStatus::stall) link_->clear_stall(true);
    count_malformed();
    return submit_in(c.slot);
  }
  failures_ = 0;
  const auto channel = channel_of(c.data);
  // What comes for a channel that nobody has open was on its way when it was left.
  if (!channel || *channel >= ports_.size()) {
    count_malformed();
  } else if (ChannelListener* const port = ports_[*channel].port) {
    port->take(decode_message(c.data, ports_[*channel].stamped));
  }
  submit_in(c.slot);
}

void Adapter::take_out(const UsbCompletion& c) {
  const unsigned channel = c.slot / InFlight::kMost;
  if (c.status == UsbStatus::stall) link_->clear_stall(false);
  if (channel < ports_.size() && ports_[channel].port != nullptr)
    ports_[channel].port->transferred(c.slot % InFlight::kMost, c.status == UsbStatus::ok);
  if (c.status == UsbStatus::gone) lose("it was unplugged");
}

void Adapter::pump() {
  while (!lost_) {
    const auto completion = link_->next_completion();
    if (!completion) return;
    if (completion->in) {
      take_in(*completion);
    } else {
      take_out(*completion);
    }
  }
}

}  // namespace rotorloop::gs_usb

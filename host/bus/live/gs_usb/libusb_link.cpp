#include "host/bus/live/gs_usb/libusb_link.hpp"

#include <libusb.h>
#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <vector>

#include "host/bus/live/gs_usb/wire.hpp"

namespace rotorloop::gs_usb {
namespace {

constexpr unsigned kTimeout_ms = 1000;  // of requests and of what goes out
constexpr int kMostRoundsOfClosing = 50;
constexpr std::int64_t kRoundOfClosing_ns = 20'000'000;

UsbStatus status_of(int error) {
  switch (error) {
    case LIBUSB_ERROR_PIPE:
      return UsbStatus::stall;
    case LIBUSB_ERROR_TIMEOUT:
      return UsbStatus::timed_out;
    case LIBUSB_ERROR_OVERFLOW:
      return UsbStatus::overflow;
    case LIBUSB_ERROR_BUSY:
      return UsbStatus::busy;
    case LIBUSB_ERROR_ACCESS:
      return UsbStatus::no_permission;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return UsbStatus::gone;
    default:
      return error >= 0 ? UsbStatus::ok : UsbStatus::failed;
  }
}

UsbStatus status_of_transfer(const libusb_transfer& t) {
  switch (t.status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return t.endpoint & LIBUSB_ENDPOINT_IN || t.actual_length == t.length ? UsbStatus::ok : UsbStatus::failed;
    case LIBUSB_TRANSFER_STALL:
      return UsbStatus::stall;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return UsbStatus::timed_out;
    case LIBUSB_TRANSFER_OVERFLOW:
      return UsbStatus::overflow;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return UsbStatus::gone;
    default:
      return UsbStatus::failed;
  }
}

class LibusbLink final : public UsbLink {
 public:
  explicit LibusbLink(const UsbAdapter& adapter) : adapter_(adapter) {}
  ~LibusbLink() override;
  LibusbLink(const LibusbLink&) = delete;
  LibusbLink& operator=(const LibusbLink&) = delete;
  int open();  // libusb's code

  UsbAnswer control(bool in, std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) override;
  UsbStatus submit_in(unsigned slot) override { return submit(in_[slot], kLargest_B); }
  UsbStatus submit_out(unsigned slot, std::span<const std::uint8_t> data) override;
  UsbStatus clear_stall(bool in) override;
  std::optional<UsbCompletion> next_completion() override;
  bool completion_waits() const override { return !ended_.empty(); }
  void wait(std::int64_t most_ns) override;
  int descriptor() const override { return epoll_; }

 private:
  struct Slot {
    LibusbLink* link = nullptr;
    libusb_transfer* transfer = nullptr;
    bool in = false, busy = false;
    unsigned number = 0;
    std::array<std::uint8_t, kLargest_B> bytes{};
  };
  static void LIBUSB_CALL on_end(libusb_transfer* transfer);
  static void LIBUSB_CALL on_descriptor(int descriptor, short events, void* link);
  static void LIBUSB_CALL on_descriptor_gone(int descriptor, void* link);
  int find_and_open();
  int make_transfers();
  void watch_descriptors();
  UsbStatus submit(Slot& slot, std::size_t size);
  void handle_events(std::int64_t most_ns);
  void end_transfers();

  UsbAdapter adapter_;
  int epoll_ = -1;
  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  bool claimed_ = false;
  std::vector<Slot> in_, out_;
  std::deque<Slot*> ended_;
  unsigned on_their_way_ = 0;
};

int LibusbLink::open() {
  epoll_ = ::epoll_create1(EPOLL_CLOEXEC);
  if (epoll_ < 0) return LIBUSB_ERROR_OTHER;
  if (const int error = libusb_init(&context_); error != 0) return error;
  watch_descriptors();
  if (const int error = find_and_open(); error != 0) return error;
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  if (const int error = libusb_claim_interface(handle_, static_cast<int>(adapter_.interface)); error != 0) return error;
  claimed_ = true;
  return make_transfers();
}

void LibusbLink::watch_descriptors() {
  libusb_set_pollfd_notifiers(context_, &on_descriptor, &on_descriptor_gone, this);
  const libusb_pollfd** const list = libusb_get_pollfds(context_);
  for (const libusb_pollfd** p = list; p != nullptr && *p != nullptr; ++p) on_descriptor((*p)->fd, (*p)->events, this);
  libusb_free_pollfds(list);
}

void LibusbLink::on_descriptor(int descriptor, short events, void* link) {
  epoll_event event{};
  event.events = static_cast<std::uint32_t>(events);  // POLLIN and POLLOUT have the same numbers
  event.data.fd = descriptor;
  ::epoll_ctl(static_cast<LibusbLink*>(link)->epoll_, EPOLL_CTL_ADD, descriptor, &event);
}

void LibusbLink::on_descriptor_gone(int descriptor, void* link) {
  ::epoll_ctl(static_cast<LibusbLink*>(link)->epoll_, EPOLL_CTL_DEL, descriptor, nullptr);
}

int LibusbLink::find_and_open() {
  libusb_device** devices = nullptr;
  const auto count = libusb_get_device_list(context_, &devices);
  if (count < 0) return static_cast<int>(count);
  int error = LIBUSB_ERROR_NO_DEVICE;
  for (libusb_device** d = devices; *d != nullptr; ++d) {
    if (libusb_get_bus_number(*d) == adapter_.bus && libusb_get_device_address(*d) == adapter_.address) error = libusb_open(*d, &handle_);
  }
  libusb_free_device_list(devices, 1);
  return error;
}

int LibusbLink::make_transfers() {
  in_.resize(kInSlots);
  out_.resize(kOutSlots);
  for (std::vector<Slot>* slots : {&in_, &out_}) {
    for (Slot& s : *slots) {
      s.link = this;
      s.in = slots == &in_;
      s.number = static_cast<unsigned>(&s - slots->data());
      s.transfer = libusb_alloc_transfer(0);
      if (s.transfer == nullptr) return LIBUSB_ERROR_NO_MEM;
      libusb_fill_bulk_transfer(s.transfer, handle_, s.in ? adapter_.endpoint_in : adapter_.endpoint_out, s.bytes.data(), kLargest_B,
                                &on_end, &s, s.in ? 0 : kTimeout_ms);
    }
  }
  return 0;
}

LibusbLink::~LibusbLink() {
  end_transfers();
  if (claimed_) libusb_release_interface(handle_, static_cast<int>(adapter_.interface));  // and the driver has it back
  if (handle_ != nullptr) libusb_close(handle_);
  for (std::vector<Slot>* slots : {&in_, &out_}) {
    for (Slot& s : *slots) libusb_free_transfer(s.transfer);
  }
  if (context_ != nullptr) {
    libusb_set_pollfd_notifiers(context_, nullptr, nullptr, nullptr);
    libusb_exit(context_);
  }
  if (epoll_ >= 0) ::close(epoll_);
}

// libusb writes to a transfer until it has ended.
void LibusbLink::end_transfers() {
  for (std::vector<Slot>* slots : {&in_, &out_}) {
    for (Slot& s : *slots) {
      if (s.busy) libusb_cancel_transfer(s.transfer);
    }
  }
  for (int round = 0; on_their_way_ > 0 && round < kMostRoundsOfClosing; ++round) handle_events(kRoundOfClosing_ns);
}

UsbAnswer LibusbLink::control(bool in, std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) {
  const int type = int{LIBUSB_REQUEST_TYPE_VENDOR} | int{LIBUSB_RECIPIENT_INTERFACE} | int{in ? LIBUSB_ENDPOINT_IN : LIBUSB_ENDPOINT_OUT};
  const int result =
      libusb_control_transfer(handle_, static_cast<std::uint8_t>(type), request, value, static_cast<std::uint16_t>(adapter_.interface),
                              data.data(), static_cast<std::uint16_t>(data.size()), kTimeout_ms);
  if (result < 0) return {.status = status_of(result), .bytes = 0};
  const bool short_order = !in && static_cast<std::size_t>(result) < data.size();
  return {.status = short_order ? UsbStatus::failed : UsbStatus::ok, .bytes = static_cast<std::size_t>(result)};
}

UsbStatus LibusbLink::submit(Slot& slot, std::size_t size) {
  if (slot.busy) return UsbStatus::busy;
  slot.transfer->length = static_cast<int>(size);
  if (const int error = libusb_submit_transfer(slot.transfer); error != 0) return status_of(error);
  slot.busy = true;
  ++on_their_way_;
  return UsbStatus::ok;
}

UsbStatus LibusbLink::submit_out(unsigned slot, std::span<const std::uint8_t> data) {
  Slot& s = out_[slot];
  if (s.busy) return UsbStatus::busy;
  std::copy(data.begin(), data.end(), s.bytes.begin());
  return submit(s, data.size());
}

UsbStatus LibusbLink::clear_stall(bool in) {
  return status_of(libusb_clear_halt(handle_, in ? adapter_.endpoint_in : adapter_.endpoint_out));
}

void LibusbLink::on_end(libusb_transfer* transfer) {
  Slot& s = *static_cast<Slot*>(transfer->user_data);
  s.busy = false;
  --s.link->on_their_way_;
  if (transfer->status != LIBUSB_TRANSFER_CANCELLED) s.link->ended_.push_back(&s);
}

void LibusbLink::handle_events(std::int64_t most_ns) {
  timeval most{.tv_sec = most_ns / 1'000'000'000, .tv_usec = most_ns % 1'000'000'000 / 1000};
  libusb_handle_events_timeout_completed(context_, &most, nullptr);
}

std::optional<UsbCompletion> LibusbLink::next_completion() {
  if (ended_.empty()) handle_events(0);
  if (ended_.empty()) return std::nullopt;
  const Slot& s = *ended_.front();
  ended_.pop_front();
  const auto bytes = static_cast<std::size_t>(std::max(s.transfer->actual_length, 0));
  return UsbCompletion{.in = s.in,
                       .slot = s.number,
                       .status = status_of_transfer(*s.transfer),
                       .bytes = bytes,
                       .data = std::span(s.bytes).first(s.in ? bytes : 0)};
}

void LibusbLink::wait(std::int64_t most_ns) {
  if (ended_.empty()) handle_events(most_ns);
}

}  // namespace

OpenedLink open_libusb(const UsbAdapter& adapter) {
  auto link = std::make_unique<LibusbLink>(adapter);
  const int error = link->open();
  if (error != 0) return {.link = nullptr, .status = error == LIBUSB_ERROR_NO_DEVICE ? UsbStatus::gone : status_of(error)};
  return {.link = std::move(link), .status = UsbStatus::ok};
}

}  // namespace rotorloop::gs_usb

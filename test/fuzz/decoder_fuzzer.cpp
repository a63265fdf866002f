// libFuzzer target (Debian's clang, AddressSanitizer and UndefinedBehaviourSanitizer): any bytes as frames, and any bytes as the payload
// of any type. Nothing may be read or written beyond its place, and what was decoded must encode to bytes that decode to the same.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "protocols/receiver.hpp"
#include "protocols/types/registry.hpp"

namespace {

using namespace rotorloop;  // a program of one file
using namespace rotorloop::protocols;

constexpr std::size_t kTypes = [] {
  std::size_t n = 0;
  for_each_message([&]<class T>() { ++n; });
  for_each_service([&]<class Request, class Response>() { n += 2; });
  return n;
}();

constexpr std::array<Subscription, kTypes> make_subscriptions() {
  std::array<Subscription, kTypes> all{};
  std::size_t n = 0;
  for_each_message(
      [&]<class T>() { all[n++] = T::kType.id <= 3 ? subscribe_anonymous(T::kType) : subscribe(TransferKind::message, T::kType); });
  for_each_service([&]<class Request, class Response>() {
    all[n++] = subscribe(TransferKind::request, Request::kType);
    all[n++] = subscribe(TransferKind::response, Response::kType);
  });
  return all;
}
constexpr auto kSubscriptions = make_subscriptions();

template <class T>
void decode_and_back(std::span<const std::uint8_t> payload, Framing framing) {
  T value{}, again{};
  if (!decode(payload, value, framing)) return;
  std::array<std::uint8_t, max_bytes<T>()> first{}, second{};
  const std::size_t size = encode(value, first, framing);
  if (!decode(std::span<const std::uint8_t>(first.data(), size), again, framing)) __builtin_trap();
  if (encode(again, second, framing) != size || first != second) __builtin_trap();
}

void decode_as(std::size_t type, std::span<const std::uint8_t> payload, Framing framing) {
  std::size_t n = 0;
  for_each_message([&]<class T>() {
    if (n++ == type) decode_and_back<T>(payload, framing);
  });
  for_each_service([&]<class Request, class Response>() {
    if (n++ == type) decode_and_back<Request>(payload, framing);
    if (n++ == type) decode_and_back<Response>(payload, framing);
  });
}

// Frames as the input has them: a byte for length and kind, one for the time since the one before, four for the identifier, data.
void receive(std::span<const std::uint8_t> in) {
  Receiver<4, 300> receiver(42, kSubscriptions);
  std::uint64_t now_us = 1;
  const auto deliver = [&](const auto& frame) {
    const auto t = receiver.accept(frame, now_us);
    if (!t) return;
    if (t->payload.size() > 300) __builtin_trap();
    for (std::size_t n = 0; n < kTypes; ++n) {
      if (kSubscriptions[n].kind == t->id.kind && kSubscriptions[n].data_type_id == t->id.data_type_id)
        decode_as(n, t->payload, t->framing);
    }
  };
  while (in.size() >= 6) {
    const bool fd = (in[0] & 0x80u) != 0;
    const std::size_t length = fd ? fd_length(in[0] & 0x3Fu) : std::min<std::size_t>(in[0] & 0x0Fu, 8);
    now_us += in[1] * std::uint64_t{10'000};
    const std::uint32_t id = (in[2] | static_cast<std::uint32_t>(in[3]) << 8 | static_cast<std::uint32_t>(in[4]) << 16 |
                              static_cast<std::uint32_t>(in[5]) << 24);
    in = in.subspan(6);
    const std::size_t have = std::min(length, in.size());
    const auto fill = [&](auto frame) {
      frame.id = id & 0x1FFFFFFFu;
      frame.extended = (id >> 31) == 0;
      frame.length = static_cast<std::uint8_t>(length);
      std::copy_n(in.begin(), have, frame.data.begin());
      deliver(frame);
    };
    fd ? fill(CanFdFrame{}) : fill(CanFrame{});
    in = in.subspan(have);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::span<const std::uint8_t> in(data + 2, size - 2);
  if (data[0] % 2 == 0) {
    receive(in);
  } else {
    decode_as(data[1] % kTypes, in, data[0] / 2 % 2 == 0 ? Framing::classic : Framing::fd);
  }
  return 0;
}

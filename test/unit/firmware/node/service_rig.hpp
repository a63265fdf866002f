// A rig with services: request in, response out.
#pragma once
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "test/unit/firmware/node/esc_rig.hpp"

namespace rotorloop::firmware {

template <std::size_t N>
inline std::string text_of(const protocols::Text<N>& t) {
  return {t.items.begin(), t.items.begin() + t.count};
}

class ServiceRig : public EscRig {
 public:
  using EscRig::EscRig;

  template <class Request>
  void ask(const Request& request, std::uint8_t source = kHost) {
    std::array<std::uint8_t, 512> payload{};
    const std::size_t size = encode(request, payload);
    send_payload(
        {.kind = protocols::TransferKind::request, .priority = 24, .data_type_id = Request::kType.id, .source = source, .destination = 42},
        Request::kType.crc_seed(), {payload.data(), size});
  }
  template <class Response, class Request>
  Response get(const Request& request) {
    sent.clear();
    ask(request);
    poll();
    const auto answers = received<Response>(protocols::TransferKind::response);
    EXPECT_EQ(answers.size(), 1u);
    return answers.empty() ? Response{} : answers.back();
  }
  protocols::ParamGetSetResponse parameter(const char* name, const protocols::ParamValue& value = {}) {
    return get<protocols::ParamGetSetResponse>(protocols::ParamGetSet{.index = 0, .value = value, .name = name});
  }
  std::vector<std::string> logs() const {
    std::vector<std::string> lines;
    for (const auto& m : received<protocols::LogMessage>()) lines.push_back(text_of(m.text));
    return lines;
  }
  // Armed and ordered, with the motor control following.
  void run() {
    arm();
    raw({0, 0, 4000, 0});
    telemetry.state = MotorState::running;
    poll();
  }
};

}  // namespace rotorloop::firmware

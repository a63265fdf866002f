// A tool on the bus of one ESC, whatever board that has. `Board` is one of board_benches.hpp:
//   Board(node_id, fail_at_us);                       a new ESC with that id (0: asks for one), power on; its port goes bus off then
//   void advance_us(std::uint64_t);                   moves time on
//   bool deliver(const CanFrame&);                    a frame of another node
//   std::vector<CanFrame> take_sent();                what the ESC has sent since
//   bool bridge() const;                              the bridge is driven
//   std::uint64_t kicks() const;                      of the watchdog
//   firmware::ResetCause cause() const;               of the newest start
//   BusState bus() const;                             of its port
//   bool update_waits() const;                        an update was found at the newest start
//   void stop_interrupt();                            the sample interrupt comes no more; not on every board
#pragma once
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/receiver.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

template <class Board>
class BoardRig {
 public:
  static constexpr std::uint8_t kTool = 120, kNode = 42;
  // No error happens before `fail_at_us`.
  explicit BoardRig(std::uint8_t node_id = kNode, std::uint64_t fail_at_us = 3'600'000'000)
      : board(node_id, fail_at_us), node_id_(node_id) {}

  void run_ms(std::uint64_t ms) {
    for (std::uint64_t k = 0; k < ms; ++k) {
      board.advance_us(1000);
      for (const CanFrame& f : board.take_sent()) sent.push_back(f);
    }
  }
  // Until `done`, for two seconds at most; whether it came true.
  template <class Condition>
  bool run_until(Condition done, std::uint64_t most_ms = 2000) {
    for (std::uint64_t k = 0; k < most_ms; ++k) {
      if (done()) return true;
      run_ms(1);
    }
    return done();
  }
  // Until the node says that it is operational.
  bool start() {
    return run_until([&] {
      const auto status = received<protocols::NodeStatus>();
      return !status.empty() && status.back().mode == protocols::NodeMode::operational;
    });
  }

  template <class T>
  void broadcast(const T& value) {
    send({.kind = protocols::TransferKind::message, .priority = 7, .data_type_id = T::kType.id, .source = kTool}, value);
  }
  template <class Response, class Request>
  std::optional<Response> ask(const Request& request) {
    sent.clear();
    send({.kind = protocols::TransferKind::request,
          .priority = 24,
          .data_type_id = Request::kType.id,
          .source = kTool,
          .destination = node_id_},
         request);
    std::vector<Response> answers;
    run_until([&] { return !(answers = received<Response>(protocols::TransferKind::response)).empty(); }, 500);
    return answers.size() == 1 ? std::optional(answers[0]) : std::nullopt;
  }
  std::optional<protocols::ParamGetSetResponse> parameter(const char* name, const protocols::ParamValue& value = {}) {
    return ask<protocols::ParamGetSetResponse>(protocols::ParamGetSet{.index = 0, .value = value, .name = name});
  }
  bool save() {
    const auto r = ask<protocols::ParamExecuteOpcodeResponse>(
        protocols::ParamExecuteOpcode{.opcode = protocols::ParamExecuteOpcode::kSave, .argument = 0});
    return r && r->ok;
  }
  bool restart() {
    const auto r = ask<protocols::RestartNodeResponse>(protocols::RestartNode{.magic = protocols::RestartNode::kMagic});
    run_ms(200);  // the answer leaves first
    sent.clear();
    return r && r->ok;
  }
  void arm() { broadcast(protocols::ArmingStatus{.status = 255}); }
  void rpm(std::int32_t value) {
    protocols::RpmCommand c;
    c.rpm[c.count++] = value;
    broadcast(c);
  }
  // The ESC's speed command every 10 ms; whether the bridge was driven meanwhile.
  bool command_for(std::uint64_t ms, std::int32_t value) {
    bool driven = false;
    for (std::uint64_t k = 0; k < ms; k += 10) {
      rpm(value);
      for (int i = 0; i < 10; ++i) {
        run_ms(1);
        driven = driven || board.bridge();
      }
    }
    return driven;
  }

  // Whole transfers of one type among what was sent.
  template <class T>
  std::vector<T> received(protocols::TransferKind kind = protocols::TransferKind::message) const {
    const std::array<protocols::Subscription, 1> subscriptions{protocols::subscribe(kind, T::kType)};
    protocols::Receiver<8, 400> receiver(kTool, subscriptions);
    std::vector<T> result;
    std::uint64_t t_us = 0;
    for (const CanFrame& f : sent) {
      if (const auto t = receiver.accept(f, ++t_us)) {
        T value;
        if (decode(t->payload, value)) result.push_back(value);
      }
    }
    return result;
  }

  Board board;
  std::vector<CanFrame> sent;

 private:
  template <class T>
  void send(const protocols::FrameId& id, const T& value) {
    std::array<std::uint8_t, 512> payload{};
    const std::size_t size = encode(value, payload);
    protocols::encode_transfer(id, T::kType.crc_seed(), transfer_id_.next(), {payload.data(), size},
                               [&](const CanFrame& f) { return board.deliver(f); });
  }
  std::uint8_t node_id_;
  protocols::TransferIdCounter transfer_id_;
};

}  // namespace rotorloop::firmware

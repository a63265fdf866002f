// A bus with a recording: every frame received from it and every frame sent to it, in the order in which this program saw them.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "host/bus/bus_recorder.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop {

class RecordedBus final : public TimedBus {
 public:
  RecordedBus(std::unique_ptr<TimedBus> bus, const std::string& path, const std::string& interface)
      : bus_(std::move(bus)), recorder_(path, interface) {}
  void close_recording() { recorder_.close(); }  // throws Error when the disk refused

  SendStatus send_any(const BusFrame& frame) override {
    const SendStatus status = bus_->send_any(frame);
    if (status == SendStatus::queued) recorder_.write(bus_->now_ns(), frame);
    return status;
  }
  std::optional<StampedBusFrame> receive_any() override {
    auto received = bus_->receive_any();
    if (received) recorder_.write(received->time_ns, received->frame);
    return received;
  }
  std::int64_t now_ns() const override { return bus_->now_ns(); }
  void wait_until(std::int64_t deadline_ns) override { bus_->wait_until(deadline_ns); }
  BusState state() const override { return bus_->state(); }
  PortCounters counters() const override { return bus_->counters(); }
  LinkCounters link_counters() const override { return bus_->link_counters(); }
  bool set_filters(std::span<const CanFilter> filters) override { return bus_->set_filters(filters); }
  std::string name() const override { return bus_->name(); }
  std::string device_for_programs() const override { return bus_->device_for_programs(); }
  int descriptor() const override { return bus_->descriptor(); }
  bool output_waits() const override { return bus_->output_waits(); }
  void flush() override { bus_->flush(); }
  std::int64_t next_flush_ns() const override { return bus_->next_flush_ns(); }
  bool input_waits() const override { return bus_->input_waits(); }
  std::optional<std::string> next_notice() override { return bus_->next_notice(); }

 private:
  std::unique_ptr<TimedBus> bus_;
  BusRecorder recorder_;
};

}  // namespace rotorloop

// A device that answers from its profile: the other end of the wire for tests, for the virtual stand and for `stand emulate`.
#pragma once
#include <functional>
#include <map>

#include "bench/stand/instruments/channel_value.hpp"
#include "bench/stand/instruments/frame.hpp"

namespace rotorloop::modbus {

// What answers requests on a bus. `now_ns` is when the device samples what it will say.
class Slave {
 public:
  virtual ~Slave() = default;
  // The PDU of the answer to a request's PDU; empty: says nothing.
  virtual std::vector<std::uint8_t> answer(std::span<const std::uint8_t> pdu, std::int64_t now_ns) = 0;
};

// Registers that can be read and written, with the exceptions that the specification asks for.
class RegisterSlave : public Slave {
 public:
  std::vector<std::uint8_t> answer(std::span<const std::uint8_t> pdu, std::int64_t now_ns) override;

 protected:
  virtual void sample(std::int64_t) {}  // before a read
  virtual bool readable(int fc, std::uint16_t address) const = 0;
  virtual std::uint16_t value(int fc, std::uint16_t address) const = 0;
  virtual bool write(std::uint16_t address, std::uint16_t value) = 0;  // false: illegal address
};

class SlaveDevice : public RegisterSlave {
 public:
  explicit SlaveDevice(Profile profile);

  // Puts a value into the registers of the first channel of this name that the device has. Throws Error (usage) for a name that is none and
  // for a value that the channel cannot hold.
  void set(std::string_view channel, double value);
  // Called before every read with the time of sampling; sets values.
  std::function<void(SlaveDevice&, std::int64_t now_ns)> on_sample;
  // Called with what the master wrote.
  std::function<void(SlaveDevice&, std::uint16_t address, std::uint16_t value)> on_write;
  // Raw bits of a channel, as it stands.
  std::uint64_t raw(std::size_t channel) const;
  void set_raw(std::size_t channel, std::uint64_t bits);
  const Profile& profile() const { return profile_; }

 protected:
  void sample(std::int64_t now_ns) override;
  bool readable(int fc, std::uint16_t address) const override;
  std::uint16_t value(int fc, std::uint16_t address) const override;
  bool write(std::uint16_t address, std::uint16_t value) override;

 private:
  using Space = std::map<std::uint16_t, std::uint16_t>;
  Space& space(int fc) { return fc == 4 ? input_ : holding_; }
  const Space& space(int fc) const { return fc == 4 ? input_ : holding_; }
  Profile profile_;
  Space holding_, input_;
};

}  // namespace rotorloop::modbus

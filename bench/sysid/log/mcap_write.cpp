#include "bench/sysid/log/mcap_write.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::log {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
constexpr double kLatestStamp_s = 1e9;         // in ns still far below 2^63
constexpr std::size_t kChunkBytes = 1u << 20;  // what a viewer loads at a time

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F
};

struct Content {
  std::string bytes;
  Content& integer(std::uint64_t v, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(v >> (8 * i));
    return *this;
  }
  Content& u16(std::uint64_t v) { return integer(v, 2); }
  Content& u32(std::uint64_t v) { return integer(v, 4); }
  Content& u64(std::uint64_t v) { return integer(v, 8); }
  Content& text(std::string_view s) {
    u32(s.size());
    bytes += s;
    return *this;
  }
};

void record(std::string& out, Opcode opcode, const Content& content) {
  out += static_cast<char>(opcode);
  out += Content{}.u64(content.bytes.size()).bytes;
  out += content.bytes;
}

Json number_field(const std::string& unit) { return {{"type", "number"}, {"description", unit}}; }

Json object_of(const std::vector<std::string>& names, const std::string& unit) {
  Json properties = Json::object();
  for (const auto& n : names) properties[n] = number_field(unit);
  return {{"type", "object"}, {"properties", properties}};
}

// One topic: how its messages are called, described and made.
struct McapTopic {
  std::string name, schema_name, unit;
  Json fields;  // JSON schema
  const std::vector<double>* t_s;
  std::function<Json(std::size_t)> at;
};

// As Foxglove's PoseInFrame has it, which its 3D view draws.
Json pose_schema() {
  const Json whole = {{"type", "integer"}};
  return {{"title", "foxglove.PoseInFrame"},
          {"type", "object"},
          {"properties",
           {{"timestamp", {{"type", "object"}, {"title", "time"}, {"properties", {{"sec", whole}, {"nsec", whole}}}}},
            {"frame_id", {{"type", "string"}, {"description", "W: x forward, y left, z up"}}},
            {"pose",
             {{"type", "object"},
              {"properties", {{"position", object_of({"x", "y", "z"}, "m")}, {"orientation", object_of({"x", "y", "z", "w"}, "1")}}}}}}}};
}

Json xyz(const Eigen::Vector3d& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

McapTopic vectors(const char* name, const char* unit, const Stream<Eigen::Vector3d>& s) {
  return {name, "rotorloop.Vector3", unit, object_of({"x", "y", "z"}, unit), &s.t_s, [&s](std::size_t i) { return xyz(s.value[i]); }};
}

McapTopic rotors(const char* name, const char* unit, const Stream<RotorValues>& s) {
  return {name, "rotorloop.Rotors", unit, object_of({"rotor_1", "rotor_2", "rotor_3", "rotor_4"}, unit), &s.t_s, [&s](std::size_t i) {
            Json out = Json::object();
            for (std::size_t k = 0; k < 4; ++k)
              if (std::isfinite(s.value[i][k])) out[fmt::format("rotor_{}", k + 1)] = s.value[i][k];
            return out;
          }};
}

McapTopic scalars(const std::string& name, const std::string& unit, const Stream<double>& s) {
  return {name, "rotorloop.Scalar", unit, object_of({"value"}, unit), &s.t_s, [&s](std::size_t i) {
            Json out = Json::object();
            if (std::isfinite(s.value[i])) out["value"] = s.value[i];
            return out;
          }};
}

// "payload_x[m]" is in m.
std::string unit_of(const std::string& extra) {
  const auto open = extra.rfind('[');
  return open == std::string::npos || extra.back() != ']' ? "" : extra.substr(open + 1, extra.size() - open - 2);
}

std::vector<McapTopic> topics_of(const FlightRecord& f, double shift_s) {
  std::vector<McapTopic> all;
  all.push_back({"/pose", "foxglove.PoseInFrame", "m, 1", pose_schema(), &f.pose.t_s, [&f, shift_s](std::size_t i) {
                   const auto& [p, q] = f.pose.value[i];
                   const double t = f.pose.t_s[i] + shift_s, sec = std::floor(t);
                   return Json{
                       {"timestamp", {{"sec", static_cast<std::int64_t>(sec)}, {"nsec", static_cast<std::int64_t>(1e9 * (t - sec))}}},
                       {"frame_id", "W"},
                       {"pose", {{"position", xyz(p)}, {"orientation", {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}}}}}};
                 }});
  all.push_back(vectors("/position_W_m", "m", f.position_W_m));
  all.push_back({"/attitude", "rotorloop.Quaternion", "1", object_of({"w", "x", "y", "z"}, "1"), &f.attitude_WS.t_s, [&f](std::size_t i) {
                   const auto& q = f.attitude_WS.value[i];
                   return Json{{"w", q.w()}, {"x", q.x()}, {"y", q.y()}, {"z", q.z()}};
                 }});
  all.push_back(vectors("/velocity_W_m_s", "m/s", f.velocity_W_m_s));
  all.push_back(vectors("/gyro_B_rad_s", "rad/s", f.gyro_B_rad_s));
  all.push_back(vectors("/accel_B_m_s2", "m/s2", f.accel_B_m_s2));
  all.push_back(rotors("/rotor_omega_rad_s", "rad/s", f.rotor_omega_rad_s));
  all.push_back(rotors("/motor_command", "1", f.motor_command));
  all.push_back(scalars("/battery_V", "V", f.battery_V));
  for (const auto& [name, stream] : f.extra) all.push_back(scalars("/extra/" + name, unit_of(name), stream));
  std::erase_if(all, [](const McapTopic& t) { return t.t_s->empty(); });
  return all;
}

// Whole seconds that make the earliest stamp positive.
double time_shift_s(const FlightRecord& f) {
  double shift_s = 0.0;
  for (const McapTopic& topic : topics_of(f, 0.0))
    for (const double t : *topic.t_s) {
      if (!(std::abs(t) < kLatestStamp_s))
        throw Error({"",
                     fmt::format("a stamp of {} s of {} cannot be written as MCAP: allowed is {} to {} s", number_text(t), topic.name,
                                 -kLatestStamp_s, kLatestStamp_s),
                     "another unit of time than the mapping says", "correct the unit of time in the mapping, or set time.start = \"zero\""},
                    ExitCode::data_quality);
      shift_s = std::max(shift_s, std::ceil(-t));
    }
  return shift_s;
}

struct Stamp {
  std::uint64_t t_ns;
  std::size_t topic, index;
};

class McapWriter {
 public:
  McapWriter(const std::vector<McapTopic>& topics, double shift_s) : topics_(topics), counts_(topics.size(), 0) {
    for (std::size_t k = 0; k < topics.size(); ++k) define(k, shift_s);
    out_ = kMagic;
    record(out_, Opcode::header, Content{}.text("").text("rotorloop"));
    out_ += schemas_ + channels_;
  }

  void add(const Stamp& s) {
    if (records_.empty()) first_ns_ = s.t_ns;
    last_ns_ = s.t_ns;
    index_[s.topic].emplace_back(s.t_ns, records_.size());
    Content m;
    m.u16(s.topic + 1).u32(counts_[s.topic]++).u64(s.t_ns).u64(s.t_ns);
    m.bytes += topics_[s.topic].at(s.index).dump();
    record(records_, Opcode::message, m);
    begin_ns_ = std::min(begin_ns_, s.t_ns);
    end_ns_ = std::max(end_ns_, s.t_ns);
    if (records_.size() >= kChunkBytes) close_chunk();
  }

  std::string finish() {
    close_chunk();
    record(out_, Opcode::data_end, Content{}.u32(0));  // 0: no checksum, here and below
    const std::size_t summary = out_.size();
    Content groups;
    const auto group = [&](Opcode opcode, const std::string& bytes) {
      if (bytes.empty()) return;
      record(groups.bytes, Opcode::summary_offset,
             Content{}.integer(static_cast<std::uint8_t>(opcode), 1).u64(out_.size()).u64(bytes.size()));
      out_ += bytes;
    };
    group(Opcode::schema, schemas_);
    group(Opcode::channel, channels_);
    std::string stats;
    record(stats, Opcode::statistics, statistics_content());
    group(Opcode::statistics, stats);
    group(Opcode::chunk_index, chunk_indexes_);
    const std::size_t offsets = out_.size();
    out_ += groups.bytes;
    record(out_, Opcode::footer, Content{}.u64(summary).u64(offsets).u32(0));
    return out_ += kMagic;
  }

 private:
  void define(std::size_t k, double shift_s) {
    const McapTopic& t = topics_[k];
    record(schemas_, Opcode::schema, Content{}.u16(k + 1).text(t.schema_name).text("jsonschema").text(t.fields.dump()));
    Content metadata;
    metadata.text("unit").text(t.unit).text("time_shift_s").text(number_text(shift_s));
    Content c;
    c.u16(k + 1).u16(k + 1).text(t.name).text("json").text(metadata.bytes);
    record(channels_, Opcode::channel, c);
  }

  void close_chunk() {
    if (records_.empty()) return;
    const std::size_t at = out_.size();
    Content c;
    c.u64(first_ns_).u64(last_ns_).u64(records_.size()).u32(0).text("").u64(records_.size());
    c.bytes += records_;
    record(out_, Opcode::chunk, c);
    const std::size_t behind = out_.size();
    Content offsets;
    for (const auto& [topic, entries] : index_) {
      offsets.u16(topic + 1).u64(out_.size());
      Content places;
      for (const auto& [t_ns, offset] : entries) places.u64(t_ns).u64(offset);
      record(out_, Opcode::message_index, Content{}.u16(topic + 1).text(places.bytes));
    }
    Content i;
    i.u64(first_ns_).u64(last_ns_).u64(at).u64(behind - at).text(offsets.bytes).u64(out_.size() - behind).text("");
    record(chunk_indexes_, Opcode::chunk_index, i.u64(records_.size()).u64(records_.size()));
    records_.clear();
    index_.clear();
    ++chunks_;
  }

  Content statistics_content() const {
    std::uint64_t all = 0;
    Content by_channel;
    for (std::size_t k = 0; k < counts_.size(); ++k) {
      all += counts_[k];
      by_channel.u16(k + 1).u64(counts_[k]);
    }
    Content c;
    c.u64(all).u16(topics_.size()).u32(topics_.size()).u32(0).u32(0).u32(chunks_);
    return c.u64(all == 0 ? 0 : begin_ns_).u64(end_ns_).text(by_channel.bytes);
  }

  const std::vector<McapTopic>& topics_;
  std::vector<std::uint64_t> counts_;
  std::string out_, schemas_, channels_, records_, chunk_indexes_;
  std::map<std::size_t, std::vector<std::pair<std::uint64_t, std::size_t>>> index_;  // of the chunk, by topic
  std::uint64_t first_ns_ = 0, last_ns_ = 0, begin_ns_ = ~std::uint64_t{0}, end_ns_ = 0, chunks_ = 0;
};

}  // namespace

std::string mcap_bytes(const FlightRecord& flight) {
  const double shift_s = time_shift_s(flight);
  const std::vector<McapTopic> topics = topics_of(flight, shift_s);
  std::vector<Stamp> stamps;
  for (std::size_t k = 0; k < topics.size(); ++k)
    for (std::size_t i = 0; i < topics[k].t_s->size(); ++i)
      stamps.push_back({static_cast<std::uint64_t>(std::llround(1e9 * ((*topics[k].t_s)[i] + shift_s))), k, i});
  std::stable_sort(stamps.begin(), stamps.end(), [](const Stamp& a, const Stamp& b) { return a.t_ns < b.t_ns; });
  McapWriter writer(topics, shift_s);
  for (const Stamp& s : stamps) writer.add(s);
  return writer.finish();
}

}  // namespace rotorloop::log

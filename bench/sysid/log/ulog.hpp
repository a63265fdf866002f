// Reads ULog, the log format of PX4 (docs.px4.io, "ULog File Format"): a file that describes its own messages. What is damaged is
// left out and noted, never guessed; memory stays proportional to the file whatever its bytes claim.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rotorloop::log {

inline constexpr std::string_view kULogMagic{"ULog\x01\x12\x35", 7};
inline constexpr std::string_view kULogSync{"\x2F\x73\x13\x20\x25\x0C\xBB\x12", 8};  // body of a synchronisation message

struct ULogTopic {
  std::string name;
  int multi_id = 0;
  std::vector<std::pair<std::size_t, std::size_t>> messages;  // begin and size of the data of each, in the file
};

class ULog {
 public:
  // Throws Error (ExitCode::data_quality) when `bytes` is no ULog, is of an unknown version or has features that readers must know
  // and this one does not. Everything else is tolerated and reported in notes().
  static ULog parse(std::string bytes, const std::filesystem::path& name_for_errors);

  const std::vector<ULogTopic>& topics() const { return topics_; }
  const ULogTopic* topic(std::string_view name, int multi_id) const;  // nullptr when the log has none
  const std::vector<std::string>& notes() const { return notes_; }
  // Information messages that are text, by key ("sys_name").
  const std::map<std::string, std::string>& info() const { return info_; }

  // Numbers of a message by path: "timestamp", "q[0]", "esc[2].esc_rpm". At most `most`.
  std::vector<std::string> fields(const std::string& topic_name, std::size_t most = 1000) const;
  // One value for each message, not-a-number where it is too short; nothing when the topic has no such field.
  std::optional<std::vector<double>> column(const ULogTopic& topic, std::string_view field) const;

 private:
  struct Field {
    std::string type, name;
    std::size_t count = 1;
    bool is_array = false;
  };
  struct Format {
    std::vector<Field> fields;
  };
  struct Place {
    std::size_t offset;
    std::string type;
  };

  void read_messages(const std::filesystem::path& name);
  void read_segment(std::size_t begin, std::size_t end, bool last);
  void read_message(char type, std::size_t begin, std::size_t size);
  void read_format(std::string_view text);
  void read_subscription(std::size_t begin, std::size_t size);
  void read_info(std::string_view body);
  std::optional<std::size_t> size_of(const std::string& type, int depth) const;
  std::optional<Place> find_field(const std::string& format, std::string_view path) const;
  void list_fields(const std::string& format, const std::string& prefix, std::size_t most, std::vector<std::string>& out, int depth) const;
  double value_at(std::size_t at, std::string_view type) const;
  std::uint64_t integer_at(std::size_t at, std::size_t bytes) const;

  std::string bytes_;
  std::map<std::string, Format> formats_;
  mutable std::map<std::string, std::optional<std::size_t>> sizes_;  // of formats, as far as asked for
  std::vector<ULogTopic> topics_;
  std::map<std::pair<std::string, int>, std::size_t> topic_index_;
  std::map<std::uint16_t, std::size_t> subscribed_;  // message id -> index into topics_
  std::map<std::string, std::string> info_;
  std::vector<std::string> notes_;
  std::vector<std::size_t> appended_;
  std::size_t unknown_type_ = 0, unknown_id_ = 0, bad_format_ = 0, dropouts_ = 0, skipped_bytes_ = 0;
  double dropout_s_ = 0.0;
};

}  // namespace rotorloop::log
